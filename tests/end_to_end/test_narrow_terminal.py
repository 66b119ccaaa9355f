"""Commands on a terminal of 80 columns: no line is longer, and no word or number is broken."""

from __future__ import annotations

import os
import re
import shlex
import struct
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from fmu_models.base import console, shipped
from identification.commands.application import COMMANDS, command_of

pty = pytest.importorskip("pty", reason="terminals as POSIX has them")
COLUMNS = 80
# what computes nothing, or little
CHEAP = (
    *("models", "maps", "scene", "data", "show disc_rig --contacts disc0", "scene disc_rig_class_a --explain"),
    *("map henon --set a=1.2 --period 2 --lyapunov", "map logistic --set r=2.9 --vary r=3.3", "--help", "fit --help"),
    *("describe data/rigs/paper_rubber", "simulate disc_rig --contacts disc0 --until 1", "fit no_such_folder"),
    *("simulate disc_rig --input w0=no_such_log.csv:speed", "inspect disc_rig.fmu", "stress --list"),
    "simulate disc_rig.fmu --method dop853 --until 0.1",
)


def on_terminal(arguments: list[str], columns: int, folder: Path) -> str:
    """What a command says on a terminal of so many columns, without colours and bars of progress."""
    import fcntl
    import termios

    here, there = pty.openpty()
    fcntl.ioctl(there, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    kept = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "LINES")}
    environment = kept | {"PYTHONPATH": str(shipped.ROOM), "TERM": "xterm"}
    line = [sys.executable, "-c", "from identification.cli import main; main()", *arguments]
    with subprocess.Popen(line, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=there, stderr=there):
        os.close(there)
        said = b""
        try:
            while block := os.read(here, 65536):
                said += block
        except OSError:  # the end, as Linux has it
            pass
    os.close(here)
    lines = [line for line in said.decode().replace("\r\n", "\n").split("\n") if not re.search("━.*%", line)]
    return "\n".join(re.sub(r"\x1b\[[\d;?]*[A-Za-z]", "", re.split(r"\r|\x1b\[2K", line)[-1]) for line in lines)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("terminal")
    for line in ("data copy rigs/paper_rubber", "export disc_rig"):
        on_terminal(shlex.split(line), COLUMNS, made)
    return made


@pytest.mark.parametrize("line", CHEAP)
def test_words_and_numbers_are_whole(line: str, folder: Path) -> None:
    said = on_terminal(shlex.split(line), COLUMNS, folder)
    assert said.strip() and "Traceback" not in said
    assert not [text for text in said.split("\n") if len(text) > COLUMNS]
    wide = on_terminal(shlex.split(line), 400, folder)
    broken = set(said.split()) - set(wide.split())
    assert not sorted(word for word in broken if word.strip("─│╭╮╰╯━╺╸"))


def test_what_goes_on_below_is_indented_and_no_word_is_broken() -> None:
    text = "  how   exact flow, by a-name-that-is-longer-than-a-line"
    lines = ["  how   exact flow,", "    by", "    a-name-that-is-longer-than-a-line"]
    assert console.hanging(text, 20, 4).split("\n") == lines


def test_what_is_pasted_stands_on_one_line() -> None:
    say = "The drives' log 'a b.csv' isn't clear: "
    for pasted in ("'rows by name'", "`x = 2 * y`", "--set 'a=1, ratio 3'", "--read sheet=NAME", '"a b c d"'):
        for width in range(10, 80):
            lines = console.hanging(f"{say}{pasted} says that it's so.", width).split("\n")
            assert any(pasted in line for line in lines) and any("'a b.csv'" in line for line in lines)
    command = "stickslip describe FILES --set w:FILE=VALUE"
    for end in ("", ".", ". Or not.", "; or not."):
        assert command + end[:1] in console.hanging(say + command + end, 30).split("\n")[2]
    # what is not in it wraps as ever
    assert console.hanging("the drives' logs, it's so", 12) == "the drives'\nlogs, it's\nso"


def test_examples_break_between_options(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said = [line.strip() for line in on_terminal(["simulate", "--help"], COLUMNS, folder).split("\n")]
    assert "-o run.h5" in said and "--plot y,phi_M,phi_S --plot phi_S:w_S" in said
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    for name in COMMANDS:
        if not isinstance(command := command_of(name), typer.Typer):
            for text in console.flowing(command).split("\n\n"):
                lines = text.split("\n")
                assert not text.startswith("Example:") or max(map(len, lines)) <= COLUMNS - 2
                # no option stands at the end of a line without its value
                assert not any(re.fullmatch("[^-].*", after) for after in lines[1:]), text


def test_usage_errors_break_between_words(folder: Path) -> None:
    said = on_terminal(shlex.split("simulate disc_rig --until many"), COLUMNS, folder)
    assert "to parse string as a" in " ".join(said.split()) and max(map(len, said.split("\n"))) <= COLUMNS
