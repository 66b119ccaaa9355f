"""Options read without pydantic are what typer reads, and what it refuses is refused in its words."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer
from typer.core import TyperCommand, TyperGroup
from typer.testing import CliRunner

from fmu_models.base.plain_options import PlainCommand, PlainGroup

read: dict[str, Any] = {}


def command(
    name: Annotated[str, typer.Argument()] = "x",
    path: Annotated[Path | None, typer.Option(dir_okay=False)] = None,
    number: float | None = None,
    count: Annotated[int | None, typer.Option(min=2, max=9)] = None,
    clamped: Annotated[int, typer.Option(min=2, max=9, clamp=True)] = 3,
    text: list[str] | None = None,
    flag: bool = False,
    hexadecimal: Annotated[int, typer.Option(parser=lambda text: int(text, 16))] = 0,
) -> None:
    read.clear()
    read.update({key: (value, type(value)) for key, value in locals().items()})


def outcome(plain: bool, arguments: list[str]) -> tuple[object, ...]:
    app = typer.Typer(cls=PlainGroup if plain else TyperGroup, add_completion=False)
    app.callback()(lambda: None)
    app.command("go", cls=PlainCommand if plain else TyperCommand)(command)
    read.clear()
    result = CliRunner().invoke(app, ["go", *arguments])
    return result.exit_code, result.output, dict(read)


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["model", "--flag", "--text", "a=1", "--text", "", "--text", "[b]"],
        *(
            ["--number", number]
            for number in ("25", "-1e-3", "+2.", ".5", "inf", "nan", " 3", "1_0", "x", "٣", "1e999")
        ),
        *(["--count", number] for number in ("2", "9", "1", "10", "+5", "3.0", "2x", "٣", "9" * 30)),
        ["--clamped", "100"],
        ["--hexadecimal", "10"],
        ["--path", "none/such.csv"],
        ["--path", "."],
        ["--path", ""],
    ],
)
def test_read_as_by_typer(arguments: list[str]) -> None:
    ours, theirs = outcome(True, arguments), outcome(False, arguments)
    assert repr(ours) == repr(theirs)


def test_a_short_command_brings_no_pydantic() -> None:
    code = (
        "import sys; sys.argv[1:] = ['simulate', 'no_such_model', '--until', '5', '--set', 'k=1', '-o', 'a.csv']\n"
        "from identification.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "sys.exit('pydantic' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=False).returncode == 0
