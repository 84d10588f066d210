"""Work in a process by itself, so that its memory is its own."""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

Result = TypeVar("Result")

_STATUS = Path("/proc/self/status")


def in_own_process(function: Callable[..., Result], *arguments: Any) -> Result:
    """What a function returns that is called in a new process, which then ends.

    Both must be picklable. The process starts empty, with the environment of this one.
    """
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=spawn) as executor:
        return executor.submit(function, *arguments).result()


def peak_megabytes() -> float:
    """The most memory that this process had at any time, in units of 10^6 bytes.

    Its resident set. Linux tells of the process since its program was loaded; elsewhere it is what
    `getrusage` says, which may be of the process that started it.
    """
    if _STATUS.exists():
        found = dict(line.split(":", 1) for line in _STATUS.read_text().splitlines())
        return int(found["VmHWM"].split()[0]) * 1024 / 1e6
    import resource

    # In bytes on macOS, else in units of 1,024.
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6
