"""Try the cases of `fuzz`, guided by coverage: what reaches new lines of lixel is changed further.

`python tests/tools/fuzz_guided.py -runs=100000 -max_len=2000 [CORPUS]` takes the options of
libFuzzer; an input that is a fault is written to a file, which is run again where it is given in
place of the corpus. It needs Atheris (`pip install lixel[fuzz]`), on Linux or macOS.
"""

from __future__ import annotations

import random
import sys
import warnings


class FromBytes(random.Random):
    """Random numbers that bytes spell out; zeros once these have run out."""

    def __init__(self, data: bytes) -> None:
        super().__init__(0)
        self.data = data
        self.place = 0

    def getrandbits(self, k: int, /) -> int:
        count = -(-k // 8)
        taken = self.data[self.place : self.place + count]
        self.place += count
        return int.from_bytes(taken.ljust(count, b"\0"), "little") >> (8 * count - k)

    def random(self) -> float:
        return self.getrandbits(16) / 2**16


def main() -> None:
    import atheris

    with atheris.instrument_imports(include=["lixel"]):
        import fuzz
    import numpy as np

    warnings.simplefilter("error")
    np.seterr(all="ignore")
    # One in a hundred renders or loads, as in the long run without guidance.
    cases = [*fuzz.QUICK * 22, *fuzz.SLOW]

    def attempt(data: bytes) -> None:
        r = FromBytes(data)
        fuzz.attempt(r.choice(cases), r)

    atheris.Setup(sys.argv, attempt)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
