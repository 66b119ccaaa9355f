"""What the commands for logs of other machines share: recipes in, results out."""

from __future__ import annotations

import json as json_files
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.console import Json, Overwrite
from fmu_models.base.files import refuse_existing
from identification.commands.fits import FigurePath, print_files, write_text

if TYPE_CHECKING:
    from rich.console import Console

RecipeArgument = Annotated[
    str, typer.Argument(metavar="RECIPE", help="A TOML file, or a name of 'stickslip data'.", show_default=False)
]
Log = Annotated[Path, typer.Argument(metavar="LOG", help="A log of any kind that is read.")]


@dataclass(frozen=True)
class ResultFiles:
    """Where a result goes: a file, a figure, the shell."""

    result: Annotated[Path | None, typer.Option("--result", "-o", help="Write the result as JSON.")] = None
    figure: FigurePath = None
    overwrite: Overwrite = False
    json: Json = False

    def check(self) -> None:
        """Refuse files before the work rather than after it."""
        refuse_existing(self.result, self.figure, overwrite=self.overwrite)
        if self.figure:
            from fmu_models.base.figures import check_format

            check_format(self.figure)

    def say(self, found: dict[str, Any], report: Callable[[], Any]) -> None:
        """Write the result if asked for, and print it as JSON, or its report and the files written."""
        content = _finite(found)
        if self.result:
            text = json_files.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
            write_text(self.result, text, self.overwrite)
        files = [str(path) for path in (self.result, self.figure) if path]

        def show(out: Console) -> None:
            out.print(report())
            print_files(files, out)

        console.say(self.json, {**content, "files": files}, show)


def _finite(value: Any) -> Any:
    """JSON knows no NaN: None stands for a value that there is not."""
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
