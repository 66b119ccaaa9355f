"""Command that opens the studio."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from identification.commands import application


def studio(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Of the study; it is made.")] = Path("study"),
    port: Annotated[int, typer.Option(help="Of this machine; 0: one that is free.", min=0, max=65535)] = 0,
    browse: Annotated[bool, typer.Option("--open/--no-open", help="Open it in the browser.")] = True,
) -> None:
    """Open a page to work in: drop logs or an FMU, answer questions, fit, compare, explore, with every command a form.

    It serves this machine alone, until Ctrl-C. What was done stands in FOLDER/study.toml; 'stickslip run' repeats it.

    Example: stickslip studio my_study
    """
    try:
        import tornado  # noqa: F401 # whether it is there
    except ImportError as error:
        raise StickslipError("The studio needs tornado: pip install 'stickslip[studio]'.") from error
    from identification.studio.server import Desk

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StickslipError(f"The folder '{folder}' cannot be made: {error.strerror}. Name another.") from error
    desk = Desk(folder, _summaries(), lambda name: _made([name])[name])
    try:
        asyncio.run(_serve(desk, port, browse))
    finally:
        desk.steps.close()


async def _serve(desk: Any, port: int, browse: bool) -> None:
    import webbrowser

    from identification.studio.server import serve

    _, address = serve(desk, port)
    out = console.console()
    out.print(console.plain(f"The studio of {desk.folder} is at {address}"), soft_wrap=True)
    out.print("Ctrl-C ends it.")
    if browse:
        webbrowser.open(address)
    await asyncio.Event().wait()


def _made(arguments: list[str]) -> dict[str, Any]:
    """The commands that arguments ask for, as typer makes them."""
    made: Any = typer.main.get_command(application.only(arguments))
    return made.commands


def _summaries() -> dict[str, str]:
    """What each command does; of groups nothing."""
    return {name: command.help or "" for name, command in _made([]).items() if name not in application.GROUPS}
