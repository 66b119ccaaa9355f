"""What several commands do with fits: make, read, draw and print them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base.files import write_whole

if TYPE_CHECKING:
    from rich.console import Console

    from identification.fit.result import FrictionFit
    from identification.measurement.free_decay import FreeDecay
    from identification.measurement.pooling import Pool
    from identification.model_check.families import FamilyComparison
    from rig_io.logs.log import RigLog

FitFile = Annotated[Path, typer.Argument(metavar="FIT", help="Result of 'stickslip fit --result'.")]
FigurePath = Annotated[Path | None, typer.Option("--figure", help="Draw the figure (png, svg, pdf).")]


def fit_logs(
    logs: Sequence[RigLog], *, allow_no_stick: bool = False, **options: Any
) -> tuple[FreeDecay | None, Pool, FrictionFit]:
    """Free decay (if there is one among the logs), what was made ready for the fit, and the fit.

    options: of `identification.fit.fit_friction`.
    """
    from identification.fit.fit import fit_friction
    from identification.measurement.free_decay import fit_free_decay
    from identification.measurement.pooling import pool

    decays = [log for log in logs if log.kind == "free-decay"]
    decay = fit_free_decay(decays[0]) if decays else None
    ready = pool(logs, free_decay=decay, allow_no_stick=allow_no_stick)
    return decay, ready, fit_friction(ready, **options)


def write_text(path: Path, text: str, overwrite: bool) -> None:
    """Write a text file whole."""
    with write_whole(path, overwrite=overwrite) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def draw_friction(found: FrictionFit, ready: Pool, path: Path, overwrite: bool) -> None:
    """Write the figure of a fit."""
    from fmu_models.report.figures import save_figure
    from identification.fit.samples import samples_by_disc
    from identification.report.friction_figure import friction_figure

    save_figure(friction_figure(found, samples_by_disc(found, ready)), path, overwrite=overwrite)


def draw_families(families: Sequence[FamilyComparison], path: Path, overwrite: bool) -> tuple[Path, ...]:
    """Write a figure for each family; those after the first have the names of their discs added to theirs."""
    from fmu_models.report.figures import save_figure
    from identification.report.family_figure import family_figure

    written = family_paths(path, families)
    for family, target in zip(families, written, strict=True):
        save_figure(family_figure(family), target, overwrite=overwrite)
    return written


def family_paths(path: Path, families: Sequence[FamilyComparison]) -> tuple[Path, ...]:
    """The file of each family's figure."""
    discs = ("-".join(family.members[0].drive_speeds) for family in families)
    return tuple(path.with_stem(f"{path.stem}-{names}") if i else path for i, names in enumerate(discs))


def print_fit(decay: FreeDecay | None, found: FrictionFit, files: Sequence[str], out: Console) -> None:
    from identification.report.terminal_tables import decay_table, fit_report

    if decay:
        out.print(decay_table(decay))
    out.print(fit_report(found))
    print_files(files, out)


def print_comparison(families: Sequence[FamilyComparison], files: Sequence[str], out: Console) -> None:
    """Families, and the files written."""
    from identification.model_check.table import comparison_report

    out.print(comparison_report(families))
    print_files(files, out)


def print_files(files: Sequence[str], out: Console) -> None:
    """The files written."""
    for path in files:
        out.print(f"written: {path}")
