"""All commands of `stickslip`, one file each, which imports what it needs when it is called."""

import copy
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Annotated

import typer
from typer.models import CommandInfo

from fmu_models.analyses.declaration import ANALYSES
from fmu_models.base import console
from fmu_models.base.version import version
from fmu_models.commands.analysis import command_of, summaries
from fmu_models.commands.data import app as data_commands
from fmu_models.commands.docs import docs
from fmu_models.commands.map import show_map
from fmu_models.commands.new import app as new_commands

HELP = "Non-smooth oscillators as FMUs, friction laws from rig logs, and an emulator of the rig."
app = console.app(HELP, completion=True)


def _commands(package: str, names: str) -> tuple[Callable[..., None], ...]:
    """The commands of a package, each in a file that is called like it."""
    return tuple(getattr(import_module(f"{package}.commands.{name}"), name) for name in names.split())


MODELS = _commands("fmu_models", "models show export simulate explore inspect couple scene bench stress maps")
FRICTION = (
    *_commands("rig_io", "describe emulate"),
    *_commands(
        "identification",
        "calibrate track fit demo laws design excite compare report apply inverse hysteresis decay slips watch",
    ),
)
for command in MODELS:
    app.command(help=console.flowing(command))(command)
app.command("map", help=console.flowing(show_map))(show_map)
app.add_typer(new_commands, name="new")
app.add_typer(data_commands, name="data")
for command in (docs, *FRICTION):
    app.command(help=console.flowing(command))(command)


def _say_version(asked: bool) -> None:
    if asked:
        print(f"stickslip {version()}")
        raise typer.Exit


@app.callback(help=HELP)
def options(
    asked: Annotated[
        bool, typer.Option("--version", callback=_say_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """What is asked of the suite as a whole."""


def whole() -> typer.Typer:
    """All commands, those of the analyses included: their files are imported, which takes long."""
    return _with_analyses({name: command_of(name) for name in ANALYSES.names()})


def _with_analyses(commands: Mapping[str, Callable[..., None]]) -> typer.Typer:
    made = copy.copy(app)
    made.registered_commands = list(app.registered_commands)
    for name, command in commands.items():
        made.command(name, help=console.flowing(command))(command)
    return made


def _listed(name: str, summary: str) -> Callable[..., None]:
    """A command of which the list of all says its name and what it does."""

    def command() -> None: ...

    command.__name__, command.__doc__ = name, summary
    return command


def only(arguments: Sequence[str]) -> typer.Typer:
    """What these arguments of the command line need: the command they begin with, or a list of all.

    To read the options of all of them takes as long as to import all of their files.
    """
    asked = arguments[0] if arguments else ""
    if any(name.endswith("_COMPLETE") for name in os.environ):
        return whole()
    if asked in ANALYSES.names():
        made = _with_analyses({asked: command_of(asked)})
        made.registered_commands, made.registered_groups = made.registered_commands[-1:], []
        return made
    commands = [
        registered_command for registered_command in app.registered_commands if _name_of(registered_command) == asked
    ]
    groups = [registered_group for registered_group in app.registered_groups if registered_group.name == asked]
    if not commands and not groups:
        return _with_analyses({name: _listed(name, text) for name, text in summaries().items()})
    small = copy.copy(app)
    small.registered_commands, small.registered_groups = commands, groups
    return small


def _name_of(command: CommandInfo) -> str:
    return command.name or command.callback.__name__ if command.callback else ""


def run() -> None:
    """Run it, and end the process."""
    console.run(only(sys.argv[1:]))
