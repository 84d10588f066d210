"""The help of the command `lixel`, and what shells complete of its words."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess

import pytest

from lixel import cli, completion

COMMANDS = [*cli.COMMANDS.items(), *((f"lab {name}", c) for name, c in cli.LAB.items())]


@pytest.mark.parametrize(
    ("groups", "commands"), [(cli.GROUPS, cli.COMMANDS), (cli.LAB_GROUPS, cli.LAB)]
)
def test_every_command_is_in_one_group(groups, commands):
    assert sorted(name for group in groups.values() for name in group) == sorted(commands)


def test_the_help_lists_commands_by_groups(capsys):
    for given, groups, commands in (
        ([], cli.GROUPS, cli.COMMANDS),
        (["lab"], cli.LAB_GROUPS, cli.LAB),
    ):
        with pytest.raises(SystemExit):
            cli.main([*given, "--help"])
        out = capsys.readouterr().out
        assert all(len(line) <= 80 for line in out.splitlines())
        for title, names in groups.items():
            own = out.split(f"{title}:\n")[1].split("\n\n")[0]
            assert re.findall(r"^  (\w+)", own, re.M) == list(names)
        for command in commands.values():
            assert " ".join(command.help.split())[:40] in " ".join(out.split())


@pytest.mark.parametrize(("name", "command"), COMMANDS, ids=[name for name, _ in COMMANDS])
def test_examples_are_commands(name, command, capsys):
    with pytest.raises(SystemExit):
        cli.main([*name.split(), "--help"])
    out = capsys.readouterr().out
    assert all(f"  {example}\n" in out for example in command.examples)
    for example in command.examples:
        words = shlex.split(example.split(" > ")[0])
        assert words[0] == "lixel"
        options = cli.parser().parse_args(cli._with_vectors_joined(words[1:]))
        assert name == "lab" or options.run is command.run


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        ("lixel re", {"render"}),
        ("lixel render col", {"colonnade"}),
        ("lixel render colonnade --method cube+n", {"cube+notw"}),
        ("lixel render colonnade --meth", {"--method"}),
        ("lixel render colonnade --device c", {"cpu"}),
        ("lixel lab st", {"study", "stress"}),
        ("lixel lab study col", {"colonnade"}),
        ("lixel render to", {"town.glb"}),
        ("lixel completion z", {"zsh"}),
    ],
)
def test_bash_completes(words, completed, bash):
    assert bash(words) == completed


@pytest.fixture(scope="module")
def bash(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bash")
    (folder / "town.glb").touch()
    (folder / "lixel.sh").write_text(completion.script(cli.parser(), "bash"))

    def complete(words):
        code = (
            f"source ./lixel.sh; COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); "
            'COMPREPLY=(); _shtab_lixel; printf "%s\\n" "${COMPREPLY[@]}"'
        )
        ran = subprocess.run(
            ["bash", "-c", code], cwd=folder, capture_output=True, text=True, check=True
        )
        return set(ran.stdout.split())

    return complete


@pytest.mark.parametrize("shell", completion.SHELLS)
def test_scripts_are_read_by_their_shell(shell, tmp_path, capsys):
    assert cli.main(["completion", shell]) == 0
    script = tmp_path / "script"
    script.write_text(capsys.readouterr().out)
    assert "cube+notw" in script.read_text()
    if (command := shutil.which(shell)) is not None:
        option = "-f" if shell == "tcsh" else "-n"
        ran = subprocess.run([command, option, str(script)], capture_output=True, text=True)
        assert (ran.returncode, ran.stderr) == (0, "")


def test_without_shtab_the_remedy_is_told(monkeypatch, capsys):
    monkeypatch.setitem(__import__("sys").modules, "shtab", None)
    assert cli.main(["completion", "bash"]) == 2
    assert "pip install 'lixel[completion]'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("given", "nearest"),
    [
        (["rendr"], "render"),
        (["lab", "stduy"], "study"),
        (["render", "plane_and_box", "-o", "x.png", "--metod", "rtw"], "--method"),
        (["completion", "bsh"], "bash"),
    ],
)
def test_the_nearest_word_is_named(given, nearest, capsys):
    assert cli.main(given) == 2
    assert capsys.readouterr().err.endswith(f"; did you mean '{nearest}'?\n")
