"""All commands of `stickslip`, one file each; a call imports that of its own command alone."""

import ast
import os
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from fmu_models.analyses.declaration import ANALYSES
from fmu_models.base import console
from fmu_models.base.plain_options import PlainCommand
from fmu_models.base.version import version

HELP = "Non-smooth oscillators as FMUs, friction laws from rig logs, and an emulator of the rig."
MODELS = ("models", "show", "export", "simulate", "explore", "inspect", "couple", "scene", "bench", "stress", "maps")
RIG = ("describe", "emulate")
FITS = (
    *("calibrate", "track", "fit", "demo", "laws", "design", "excite", "compare", "report", "apply", "inverse"),
    *("hysteresis", "decay", "slips", "series", "watch", "studio", "run"),
)
GROUPS = ("new", "data")  # of commands of their own
COMMANDS = {
    **dict.fromkeys((*MODELS, "map", *GROUPS, "docs"), "fmu_models"),
    **dict.fromkeys(RIG, "rig_io"),
    **dict.fromkeys(FITS, "identification"),
}
FUNCTIONS = {"map": "show_map"}  # of files that are called like a command and hold another name


def _say_version(asked: bool) -> None:
    if asked:
        print(f"stickslip {version()}")
        raise typer.Exit


def _options(
    asked: Annotated[
        bool, typer.Option("--version", callback=_say_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """What is asked of the suite as a whole."""


def _made(names: Sequence[str], of: Callable[[str], Callable[..., None] | typer.Typer]) -> typer.Typer:
    """An application of some commands."""
    app = console.app(HELP, completion=True)
    app.callback(help=HELP)(_options)
    for name in names:
        command = of(name)
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name)
        else:
            app.command(name, cls=PlainCommand, help=console.flowing(command))(command)
    return app


def command_of(name: str) -> Callable[..., None] | typer.Typer:
    """A command, or a group of them; its file is imported, and of an analysis what declares it, which takes longer."""
    if name not in COMMANDS:
        from fmu_models.commands import analysis

        return analysis.command_of(name)
    module = import_module(f"{COMMANDS[name]}.commands.{name}")
    return module.app if name in GROUPS else getattr(module, FUNCTIONS.get(name, name))


def whole() -> typer.Typer:
    """All commands, whose files are all imported."""
    return _made((*COMMANDS, *ANALYSES.names()), command_of)


def _listed(name: str, texts: dict[str, str]) -> Callable[..., None] | typer.Typer:
    """A command of which the list of all says its name and what it does; nothing is imported for it."""
    if name in GROUPS:
        return command_of(name)
    if name in COMMANDS:
        spec = find_spec(f"{COMMANDS[name]}.commands")
        assert spec is not None and spec.submodule_search_locations
        tree = ast.parse((Path(spec.submodule_search_locations[0]) / f"{name}.py").read_text("utf-8"))
        wanted = FUNCTIONS.get(name, name)
        function = next(node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == wanted)
        texts = {name: ast.get_docstring(function) or ""}

    def command() -> None: ...

    command.__name__, command.__doc__ = name, texts[name].split("\n\n")[0]
    return command


def only(arguments: Sequence[str]) -> typer.Typer:
    """What these arguments of the command line need: the command they begin with, or a list of all."""
    asked = arguments[0] if arguments else ""
    if any(name.endswith("_COMPLETE") for name in os.environ):
        return whole()
    if asked in COMMANDS or asked in ANALYSES.names():
        return _made([asked], command_of)
    from fmu_models.commands.analysis import summaries

    texts = summaries()
    return _made((*COMMANDS, *texts), lambda name: _listed(name, texts))
