"""One build that holds many mutants: the environment says which of them a process runs.

A function that is mutated gets a body for each of its mutants beside its own (Untch, Offutt and
Harrold, "Mutation analysis using mutant schemata", 1993), so that the core is compiled once.
"""

from __future__ import annotations

import bisect
import re
from collections import defaultdict
from pathlib import Path

from mutant_list import Mutant

# Names the number of a mutant; none where it is not set.
VARIABLE = "LIXEL_MUTANT"

CHOSEN = f"""
/// The mutant that the environment names, zero for none.
#[inline]
fn chosen_mutant() -> u32 {{
    static CHOSEN: std::sync::OnceLock<u32> = std::sync::OnceLock::new();
    *CHOSEN.get_or_init(|| std::env::var("{VARIABLE}").map_or(0, |text| text.parse().unwrap()))
}}
"""

# Before the name of a function: that it has no code of its own.
INLINED = re.compile(
    r"#\[inline\(always\)\](\n(?:[ \t]*(?:#\[.*\]|///.*)\n)*[ \t]*(?:pub(?:\(.*\))? )?)$"
)

# Comments, texts and characters: braces in them are none.
NO_CODE = re.compile(
    r'//[^\n]*|/\*.*?\*/|b?r(#*)".*?"\1|b?"(?:\\.|[^"\\])*"|b?\'(?:\\[^\']+|[^\'\\])\'', re.DOTALL
)


def apart(before: str) -> str:
    """What stands before a function, whose code is then not copied to where it is called.

    Bodies of bodies would multiply.
    """
    return INLINED.sub(r"#[inline(never)]\1", before)


def bodies(text: str) -> list[tuple[int, int]]:
    """Where the bodies of functions begin and end, of those that may have several."""
    code = NO_CODE.sub(lambda found: " " * len(found[0]), text)
    ends, open_braces = {}, []
    for brace in re.finditer("[{}]", code):
        if brace[0] == "{":
            open_braces.append(brace.start())
        else:
            ends[open_braces.pop()] = brace.end()
    found = []
    # Up to the body; the length of an array stands after a semicolon in brackets.
    array = r"\[(?:[^][]|\[[^][]*\])*\]"
    for function in re.finditer(rf"\b(const )?fn \w+(?:{array}|[^][{{}};])*\{{", code):
        # What is constant knows no environment, and `impl` stands for one type.
        if not function[1] and "-> impl " not in function[0]:
            start = function.end() - 1
            found.append((start, ends[start]))
    return found


def switched(text: str, mutants: dict[int, Mutant]) -> tuple[str, set[int]]:
    """The text with all mutants of functions, and the numbers of these."""
    known = sorted(bodies(text))
    of_body: dict[tuple[int, int], list[int]] = defaultdict(list)
    for number, mutant in mutants.items():
        place = text.index(mutant.old)
        last = place + len(mutant.old)
        before = known[: bisect.bisect(known, (place, 0))]
        around = [body for body in before if last <= body[1]]
        # Of functions in each other the innermost; what holds one that is mutated stays as it is.
        if around:
            of_body[around[-1]].append(number)
    done: set[int] = set()
    taken = len(text)
    for start, end in sorted(of_body, reverse=True):
        if end > taken:
            continue
        taken = start
        own, numbers = text[start:end], of_body[start, end]
        arms = [
            f"{number} => {own.replace(mutants[number].old, mutants[number].new)}"
            for number in numbers
        ]
        body = "\n".join(["{ match crate::chosen_mutant() {", *arms, f"_ => {own}", "} }"])
        head = text.rindex("fn ", 0, start)
        text = apart(text[:head]) + text[head:start] + body + text[end:]
        done.update(numbers)
    return text, done


def switched_files(root: Path, mutants: dict[int, Mutant]) -> tuple[dict[str, str], set[int]]:
    """The files of a project with mutants in them, and the numbers of these.

    The others are of other languages, or of what is no function.
    """
    of_file: dict[str, dict[int, Mutant]] = defaultdict(dict)
    for number, mutant in mutants.items():
        if mutant.file.endswith(".rs"):
            of_file[mutant.file][number] = mutant
    files, done = {}, set()
    for name, own in of_file.items():
        files[name], numbers = switched((root / name).read_text(), own)
        done |= numbers
    files["src/lib.rs"] = (root / "src" / "lib.rs").read_text() + CHOSEN
    return files, done
