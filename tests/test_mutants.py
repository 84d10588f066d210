"""The texts that mutants change."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "tools"))

from mutant_list import MUTANTS  # noqa: E402

pytestmark = pytest.mark.of_checkout("it reads the source")


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: f"{mutant.subject}, {mutant.name}")
def test_a_mutant_changes_a_text_that_stands_once(mutant):
    assert (ROOT / mutant.file).read_text().count(mutant.old) == 1
    assert mutant.new != mutant.old


def words_of(tests):
    """The words by which a mutant's tests are chosen, each of which must choose some."""
    kind, *options = tests
    if kind == "cargo":
        return [option for option in options if not option.startswith("-")]
    expression = options[options.index("-k") + 1] if "-k" in options else ""
    return set(re.findall(r"\w+", expression)) - {"and", "or", "not"}


def test_every_word_that_chooses_tests_finds_some():
    """A test that is renamed would leave its mutants to tests that know nothing of them."""
    chosen = {mutant.tests for mutant in MUTANTS}
    files = {option for tests in chosen for option in tests if option.endswith(".py")}
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider"]
    listed = subprocess.run([*command, *sorted(files)], cwd=ROOT, capture_output=True, text=True)
    known = listed.stdout.splitlines()
    of_rust = []
    for path in (ROOT / "src").rglob("*.rs"):
        module = "::".join(path.relative_to(ROOT / "src").with_suffix("").parts)
        functions = re.findall(r"#\[test\]\n(?: *#.*\n)* *fn (\w+)", path.read_text())
        of_rust += [module, *(f"{module}::{function}" for function in functions)]
    for tests in chosen:
        own = [test for test in known if test.split("::")[0] in tests]
        names = of_rust if tests[0] == "cargo" else own
        missing = [word for word in words_of(tests) if not any(word in name for name in names)]
        assert names
        assert missing == [], tests
