"""Run a study on a Dask cluster of this machine, and kill it in the middle.

The table has how much faster two workers are than one; nothing is lost or done twice.

    python tests/tools/cluster.py -o docs/results/studies/cluster.csv

Each worker has one core, as on a cluster it should: LP_NUM_THREADS and RAYON_NUM_THREADS are 1.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

import lixel as lx
from lixel.lab.result_tables import write

COLUMNS = ("what", "workers", "cases", "seconds", "faster")

ONE_CORE = {"LP_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1"}

METHODS = ("uniform", "desired_view", "focused", "rtw", "lispsm")
RESOLUTIONS = (128, 256)
SCENES = ("plane_and_box", "needles")


def study(workers: int, cases: int, journal: Path) -> tuple[int, float]:
    """Rows, and seconds once the cluster stands."""
    from dask.distributed import Client, LocalCluster

    random = np.random.default_rng(7)
    count = -(-cases // (len(SCENES) * len(METHODS) * len(RESOLUTIONS)))
    directional_lights = {
        str(i): lx.DirectionalLight((x, -1.0, z))
        for i, (x, z) in enumerate(random.normal(size=(count, 2)))
    }
    with (
        tempfile.TemporaryDirectory() as folder,
        LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address=None,
            local_directory=folder, env=ONE_CORE,
        ) as cluster,
        Client(cluster) as client,
    ):  # fmt: skip
        start = time.perf_counter()
        table = lx.study(
            SCENES,
            lights=directional_lights,
            methods=METHODS,
            parameters={"resolution": RESOLUTIONS},
            size=(320, 180),
            repeats=1,
            journal=journal,
            executor=client.get_executor(),
            progress=False,
        )
        seconds = time.perf_counter() - start
    assert table.attrs["complete"]
    assert table["error"].isna().all()
    return len(table), seconds


def lines(journal: Path) -> list[str]:
    return journal.read_text().splitlines() if journal.exists() else []


def killed(cases: int, journal: Path) -> int:
    """Runs the study in another process until half of it is done; how much was kept."""
    process = subprocess.Popen(
        [sys.executable, __file__, "--cases", str(cases), "--journal", str(journal)],
        start_new_session=True,
    )
    while len(lines(journal)) < cases // 2:
        time.sleep(0.2)
        assert process.poll() is None, "ended too early"
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return len(lines(journal))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--journal", type=Path, help="only run with two workers, and keep this")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="write a table")
    options = parser.parse_args()
    if options.journal is not None:
        study(2, options.cases, options.journal)
        return
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        alone, alone_s = study(1, options.cases, Path(folder, "one.jsonl"))
        both, both_s = study(2, options.cases, Path(folder, "two.jsonl"))
        assert alone == both
        rows.append(["whole", 1, alone, f"{alone_s:.1f}", ""])
        rows.append(["whole", 2, both, f"{both_s:.1f}", f"{alone_s / both_s:.2f}"])
        journal = Path(folder, "killed.jsonl")
        kept = killed(options.cases, journal)
        all_of_it, rest_s = study(2, options.cases, journal)
        assert all_of_it == both
        samples = [json.loads(line) for line in lines(journal)]
        times = Counter((sample["case"], sample["turn"]) for sample in samples if "turn" in sample)
        assert len(times) == both, f"{len(times)} of {both} cases"
        assert set(times.values()) == {1}, "done twice"
        rows.append(["killed", 2, kept, "", ""])
        rows.append(["gone on", 2, all_of_it - kept, f"{rest_s:.1f}", ""])
    for row in rows:
        print(*row)
    if options.output is not None:
        named = [dict(zip(COLUMNS, row, strict=True)) for row in rows]
        write(options.output, "python tests/tools/cluster.py", named)


if __name__ == "__main__":
    main()
