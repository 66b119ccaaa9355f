"""What the commands for logs of other machines share: recipes in, results out."""

from __future__ import annotations

import json as json_files
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.base.files import refuse_existing, write_whole

RecipeArgument = Annotated[
    str, typer.Argument(metavar="RECIPE", help="A TOML file, or a name of 'stickslip data'.", show_default=False)
]
Log = Annotated[Path, typer.Argument(metavar="LOG", help="A log of any kind that is read.")]
ResultPath = Annotated[Path | None, typer.Option("--result", "-o", help="Write the result as JSON.")]


def check_targets(result: Path | None, figure: Path | None, overwrite: bool) -> None:
    """Refuse targets before the work rather than after it."""
    refuse_existing(result, figure, overwrite=overwrite)
    if figure:
        from fmu_models.base.figures import check_format

        check_format(figure)


def finish(found: dict[str, Any], result: Path | None, figure: Path | None, overwrite: bool) -> dict[str, Any]:
    """The content for JSON, written to ``result`` if asked for."""
    content = _finite(found)
    if result:
        with write_whole(result, overwrite=overwrite) as temporary:
            text = json_files.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
            temporary.write_text(text + "\n", encoding="utf-8")
    return {**content, "files": [str(path) for path in (result, figure) if path]}


def _finite(value: Any) -> Any:
    """JSON knows no NaN: None stands for a value that there is not."""
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
