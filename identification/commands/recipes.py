"""What the commands for logs of other machines share: recipes in, results out."""

from __future__ import annotations

import json as json_files
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.figures import check_files
from fmu_models.base.record import record
from identification.commands.fits import FigurePath, write_text

RecipeArgument = Annotated[
    str, typer.Argument(metavar="RECIPE", help="A TOML file, or a name of 'stickslip data'.", show_default=False)
]
Log = Annotated[Path, typer.Argument(metavar="LOG", help="A log of any kind that is read.")]


@dataclass(frozen=True)
class ResultFiles:
    """Where a result goes: a file, a figure, the shell."""

    result: Annotated[Path | None, typer.Option("--result", "-o", help="Write the result as JSON.")] = None
    figure: FigurePath = None
    overwrite: console.Overwrite = False
    json: console.Json = False

    def check(self) -> None:
        """Refuse files before the work rather than after it."""
        check_files(self.result, figures=[self.figure], overwrite=self.overwrite)

    def draw(self, figure: Callable[[], Any]) -> None:
        """Write a figure if one is asked for."""
        if self.figure:
            from fmu_models.base.figures import save_figure

            save_figure(figure(), self.figure, overwrite=self.overwrite)

    def say(self, found: dict[str, Any], report: Callable[[], Any], figures: Sequence[Path] | None = None) -> None:
        """Write the result if asked for, and print it as JSON, or its report and the files written. figures: where
        others than the one that was asked for were drawn."""
        content = record(found)
        if self.result:
            text = json_files.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
            write_text(self.result, text, self.overwrite)
        drawn = (self.figure,) if figures is None else figures
        files = [str(path) for path in (self.result, *drawn) if path]

        def show(out: console.Console) -> None:
            out.print(report())
            console.print_files(files, out)

        console.say(self.json, {**content, "files": files}, show)
