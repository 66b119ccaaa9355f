"""Command that lists and copies what comes along: scenes, recipes, systems, example logs."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated

import typer

from fmu_models.base import console, shipped
from fmu_models.base.errors import refuse_unknown
from fmu_models.base.files import refuse_existing, write_whole

HELP = "Scenes, recipes, systems and example logs that come along: list them, copy them."
app = console.app(HELP, no_args_is_help=False)


@app.callback(invoke_without_command=True, help=HELP)
def data(context: typer.Context, json: console.Json = False) -> None:
    """List what comes along.

    Example: stickslip data
    """
    if context.invoked_subcommand is not None:
        return
    items = shipped.items()

    def show(out: console.Console) -> None:
        out.print(console.table("", ("name", "what it is"), [[name, _title(path)] for name, path in items.items()]))
        out.print("Copy one:  stickslip data copy NAME")

    console.say(json, {"items": [{"name": name, "title": _title(path)} for name, path in items.items()]}, show)


@app.command()
def copy(
    names: Annotated[list[str], typer.Argument(metavar="NAME...", help="As 'stickslip data' lists them.")],
    folder: Annotated[Path, typer.Option("--output", "-o", help="Folder to copy to.")] = Path(shipped.NAME),
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Copy some of it into a folder here, where it has the path that the manual and the examples give it.

    Example: stickslip data copy rigs/paper_rubber
    """
    items = shipped.items()
    files: list[tuple[Path, Path]] = []
    for name in names:
        refuse_unknown(name, items, f"Nothing that comes along is called '{name}'.")
        source = items[name]
        inside = sorted(path for path in source.iterdir() if path.is_file()) if source.is_dir() else [source]
        files += [(path, folder / path.relative_to(shipped.folder())) for path in inside]
    refuse_existing(*(target for _, target in files), overwrite=overwrite)
    for source, target in files:
        with write_whole(target, overwrite=overwrite) as temporary:
            shutil.copyfile(source, temporary)
    written = [str(target) for _, target in files]
    console.say(json, {"files": written}, lambda out: console.print_files(written, out))


def _title(path: Path) -> str:
    """What an item says of itself: the title of a package of logs or of a TOML file, otherwise its first line."""
    import json
    import tomllib

    if path.is_dir():
        return str(json.loads((path / "datapackage.json").read_text("utf-8")).get("title", ""))
    text = path.read_text("utf-8")
    if path.suffix == ".toml" and (title := tomllib.loads(text).get("title")):
        return str(title)
    first = text.partition("\n")[0]
    return f"Emulated log: {first}" if path.suffix == ".csv" else first.lstrip("# ")
