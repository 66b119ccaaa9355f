"""Command that builds the manual and opens it."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.temporary import temporary_folder


def docs(
    folder: Annotated[Path | None, typer.Option("--output", "-o", help="Folder to put a copy into.")] = None,
    opened: Annotated[bool, typer.Option("--open/--no-open", help="Open it in the browser.")] = True,
    build: Annotated[
        bool, typer.Option("--build", help="Build all of it here: examples run, pictures are computed, in minutes.")
    ] = False,
    json: console.Json = False,
) -> None:
    """Open the manual: tutorials, how-to pages, explanation, reference, and a gallery of all models.

    An installed suite has it built. A checkout shows its pages as they are written, until --build makes the whole of
    it, which is kept until a source changes; that needs pip install 'stickslip\\[docs]'.

    Example: stickslip docs

    Example: stickslip docs --build --no-open -o manual
    """
    import webbrowser

    from fmu_models.report.manual import Site, manual_site

    if folder is not None and (folder.is_file() or (folder.is_dir() and any(folder.iterdir()))):
        raise StickslipError(f"'{folder}' holds something already. Choose another folder for the manual.")
    start = time.monotonic()
    with console.progress("building the manual") as progress:
        site = manual_site(build=build, progress=progress)
    seconds = time.monotonic() - start
    if folder is not None:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with temporary_folder("manual", folder.parent) as work:
            shutil.copytree(site.folder, work / "site")
            if folder.is_dir():
                folder.rmdir()
            (work / "site").rename(folder)
        site = Site(folder, site.built, site.plain)
    displayed = opened and webbrowser.open(site.index.resolve().as_uri())
    content = {
        "index": str(site.index),
        "pages": site.pages,
        "built": site.built,
        "plain": site.plain,
        "seconds": round(seconds, 3),
        "opened": displayed,
    }

    def show(out: console.Console) -> None:
        built = f", built in {seconds:.0f} s" if site.built and not site.plain else ""
        out.print(f"[bold]{site.index}[/bold]: {site.pages} pages{built}")
        if site.plain:
            out.print(
                "Pages as they are written: no example was run, gallery and reference are missing. All of it, in "
                "minutes: stickslip docs --build"
            )
        if not displayed:
            out.print("Open it in a browser; it needs no network.")

    console.say(json, content, show)
