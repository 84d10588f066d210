"""Install the wheel into an empty environment, and run the README's code there.

    python tests/tools/try_wheel.py [dist/lixel-VERSION-....whl]

Without a wheel it is built first. The environment holds what the wheel itself asks for and nothing
else: no extras, nothing of this checkout.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

ROOT = Path(__file__).parents[2]

# The README opens a file of this name.
TOWN = """
import lixel as lx
import trimesh
scene = lx.scenes.plane_and_box()
trimesh.Trimesh(scene.vertices, scene.faces, process=False).export("town.glb")
"""


def main(wheels: list[str]) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wheel = Path(wheels[0]).resolve() if wheels else built(folder / "dist")
        python = environment(folder / "venv", wheel)
        for code in (TOWN, readme_code()):
            # -I: neither this folder nor PYTHONPATH.
            step([python, "-I", "-c", code], folder)
        # On Windows a program has an ending.
        lixel = shutil.which("lixel", path=str(Path(python).parent))
        assert lixel is not None
        render = ["render", "town.glb", "-o", "town.png"]
        for arguments in (["--version"], ["info"], render, ["doctor", "cpu"]):
            step([lixel, *arguments], folder)
        assert (folder / "town.png").read_bytes().startswith(b"\x89PNG")
    print("the wheel works by itself")


def built(folder: Path) -> Path:
    command = ["build", "--release", "--locked", "--strip", "--out", str(folder)]
    step([sys.executable, "-m", "maturin", *command], ROOT)
    (wheel,) = folder.glob("*.whl")
    return wheel


def environment(folder: Path, wheel: Path) -> str:
    venv.create(folder, with_pip=True)
    python = str(folder / ("Scripts" if os.name == "nt" else "bin") / "python")
    step([python, "-m", "pip", "install", "--quiet", str(wheel)], folder)
    return python


def readme_code() -> str:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return "\n".join(re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S))


def step(command: list[str], folder: Path) -> None:
    start = time.perf_counter()
    clean = {name: text for name, text in os.environ.items() if not name.startswith("PYTHON")}
    subprocess.run(command, cwd=folder, env=clean, check=True)
    words = " ".join(command[:4]).split("\n")[0]
    print(f"{time.perf_counter() - start:6.1f} s  {words}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
