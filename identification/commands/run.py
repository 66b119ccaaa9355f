"""Command that gives the commands of a study again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from identification.studio.study import begun, line, read_study


def run(
    file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study (study.toml), as 'studio' writes it.")],
    trust: console.Trust = False,
    json: console.Json = False,
) -> None:
    """Give the commands of a study again, one after the other, in its folder; the first that fails ends it.

    A study names files of its own folder; code that it names, and other places, need --trust.

    Example: stickslip run my_study/study.toml
    """
    import subprocess

    study = read_study(file)
    study.check(trust=trust)
    done = []
    for number, step in enumerate(study.steps, 1):
        if not json:
            console.console().print(console.plain(f"{number}/{len(study.steps)}  {line(step)}", style="bold"))
        process = begun(step, study.folder, stdout=subprocess.DEVNULL if json else None)
        code = process.wait()
        done.append({"step": number, "line": line(step), "code": code})
        if code:
            raise StickslipError(
                f"Step {number} of {len(study.steps)} ended with {code}: {line(step)}. Mend it, and go on."
            )
    content = {"study": str(file), "steps": done}
    console.say(json, content, lambda out: out.print(f"{len(done)} steps done."))
