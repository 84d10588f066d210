"""The texts of the checkout: spelling, and links from file to file."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.of_checkout("it reads files of the checkout")

ROOT = Path(__file__).parents[1]
PAGES = [
    *sorted(ROOT.glob("*.md")),
    *sorted((ROOT / ".github").rglob("*.md")),
    *sorted((ROOT / "docs" / "results").rglob("*.md")),
    *sorted((ROOT / "notebooks").glob("*.ipynb")),
]
"""Those of the site have a test of their own, once they are built."""

WORDS = ("hart", "unifrom")
"""The name of an author, and a slip that an example mends."""


def prose(path):
    """A text without code; of a notebook, what stands between its code."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        text = "\n\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "markdown")
    return re.sub(r"^```.*?^```$|`[^`\n]+`", "", text, flags=re.M | re.S)


def test_words_are_spelled_right(tmp_path):
    for notebook in sorted((ROOT / "notebooks").glob("*.ipynb")):
        (tmp_path / f"{notebook.stem}.md").write_text(prose(notebook), encoding="utf-8")
    kinds = {".md", ".py", ".pyi", ".rs", ".wgsl", ".yml", ".toml", ".cff", ".html", ".css"}
    folders = (ROOT / name for name in ("docs", "python", "src", "shaders", ".github"))
    files = [*ROOT.glob("*.*"), *(file for folder in folders for file in folder.rglob("*.*"))]
    texts = [str(file) for file in (*files, *tmp_path.iterdir()) if file.suffix in kinds]
    assert len(texts) > 200
    command = ["-m", "codespell_lib", "--ignore-words-list", ",".join(WORDS), *texts]
    ran = subprocess.run([sys.executable, *command], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout + ran.stderr) == (0, "")


def places(path):
    """The anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", prose(path), re.M)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_links_to_files_lead_somewhere(page):
    broken = []
    for link in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if re.match(r"https?://|mailto:", link):
            continue
        name, _, place = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        if not target.exists() or (place and place not in places(target)):
            broken.append(link)
    assert broken == []
