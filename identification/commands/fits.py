"""What several commands do with fits: make, read, draw and print them."""

from __future__ import annotations

import json as json_files
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import write_whole
from identification.commands.logs import Stated
from identification.disturbances import DISTURBANCES
from identification.estimators import ESTIMATORS
from identification.inference.defaults import AUTO, NONE

if TYPE_CHECKING:
    from identification.calibration.result import Calibration
    from identification.fit.result import FrictionFit
    from identification.inference.posterior import Posterior
    from identification.measurement.free_decay import FreeDecay
    from identification.measurement.pooled import Pool
    from identification.model_check.families import FamilyComparison
    from identification.report.page import Findings
    from rig_io.logs.log import RigLog

FitFile = Annotated[
    Path,
    typer.Argument(metavar="FIT", help="Result of 'stickslip fit', 'inverse', 'calibrate', 'hysteresis' or 'decay'."),
]
FigurePath = Annotated[Path | None, typer.Option("--figure", help="Draw the figure (png, svg, pdf).")]
Disturbing = Annotated[
    str,
    typer.Option(
        metavar="none|auto|NAME,...",
        help=f"Estimated beside the law: {', '.join(DISTURBANCES.names())}, or your own, my_disturbance.py; "
        "auto: those shown.",
    ),
]

EstimatorName = Annotated[
    str, typer.Option("--estimator", help=f"{', '.join(ESTIMATORS.names())}, or your own, my_estimator.py.")
]

Sampled = TypeVar("Sampled", "FrictionFit", "Calibration")

RATIOS = ("k/J", "c/J")  # constants that a free decay gives
NOTHING = Stated()
ANY_MODEL, MACHINE, RIG = "any model", "a machine", "a rig"  # what there are fits of


def fitted_kind(path: Path) -> str:
    """What a file holds a fit of: `ANY_MODEL`, `MACHINE`, or else `RIG`, whose reader tells what is wrong in one that
    is none."""
    from identification.calibration.result import KIND, LOOPS

    try:
        content = json_files.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return RIG
    if not isinstance(content, dict):
        return RIG
    return ANY_MODEL if content.get("type") in (KIND, LOOPS) else MACHINE if "machine" in content else RIG


def sampled(found: Sampled, draw: Callable[[], Posterior]) -> Sampled:
    """The fit with its posterior; without it, in words, where chains had not converged or an interrupt came."""
    if found.interrupted:
        return found
    try:
        return replace(found, posterior=draw())
    except StickslipError as error:
        return replace(found, warnings=(f"No posterior: {error}", *found.warnings))
    except KeyboardInterrupt:
        return replace(found, warnings=("Interrupted: the posterior was not sampled to its end.", *found.warnings))


def named(disturbances: str) -> str | list[str]:
    """What is to be sought or estimated."""
    if disturbances in (NONE, AUTO):
        return disturbances
    return [name.strip() for name in disturbances.split(",")]


def decay_of(logs: Sequence[RigLog], said: Stated = NOTHING) -> FreeDecay | None:
    """The free decay, if there is one among the logs, with ratios that are said in place of its own. StickslipError: a
    ratio is set and there is no free decay, or a constant that the decay takes the place of."""
    from identification.measurement.free_decay import fit_free_decay

    ratios = {name: said.values[name] for name in RATIOS if name in said.values}
    for name in RATIOS:
        if name in said.deviations and name not in ratios:
            raise StickslipError(f"An uncertainty of {name} needs its value: --set {name}=VALUE±SD.")
    decays = [log for log in logs if log.kind == "free-decay"]
    if not decays:
        if ratios:
            name = next(iter(ratios))
            raise StickslipError(f"{name} is known from a free decay, and none is among the logs. Set {name[0]} and J.")
        return None
    for name in ("k", "c"):
        if name in said.values:
            raise StickslipError(
                f"{name}/J is known from the free decay '{decays[0].name}', so that {name} is not used. Set {name}/J."
            )
    deviations = {name: said.deviation(name, value) for name, value in ratios.items()}
    return fit_free_decay(decays[0]).with_ratios(ratios, deviations)


def fit_logs(
    logs: Sequence[RigLog], decay: FreeDecay | None, *, allow_no_stick: bool = False, **options: Any
) -> tuple[Pool, FrictionFit]:
    """What was made ready for the fit, and the fit.

    options: of `identification.fit.fit_friction`.
    """
    from identification.fit.fit import fit_friction
    from identification.measurement.pooling import pool

    ready = pool(logs, free_decay=decay, allow_no_stick=allow_no_stick)
    return ready, fit_friction(ready, **options)


def write_text(path: Path, text: str, overwrite: bool) -> None:
    """Write a text file whole."""
    with write_whole(path, overwrite=overwrite) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def draw_friction(found: FrictionFit, ready: Pool, path: Path, overwrite: bool) -> None:
    """Write the figure of a fit."""
    from fmu_models.base.figures import save_figure
    from identification.fit.samples import samples_by_disc
    from identification.report.friction_figure import friction_figure

    save_figure(friction_figure(found, samples_by_disc(found, ready)), path, overwrite=overwrite)


def draw_families(families: Sequence[FamilyComparison], path: Path, overwrite: bool) -> tuple[Path, ...]:
    """Write a figure for each family; those after the first have the names of their discs added to theirs."""
    from fmu_models.base.figures import save_figure
    from identification.report.family_figure import family_figure

    written = family_paths(path, families)
    for family, target in zip(families, written, strict=True):
        save_figure(family_figure(family), target, overwrite=overwrite)
    return written


def family_paths(path: Path, families: Sequence[FamilyComparison]) -> tuple[Path, ...]:
    """The file of each family's figure."""
    discs = ("-".join(family.members[0].drive_speeds) for family in families)
    return tuple(path.with_stem(f"{path.stem}-{names}") if i else path for i, names in enumerate(discs))


def print_fit(decay: FreeDecay | None, found: FrictionFit, files: Sequence[str], out: console.Console) -> None:
    from identification.report.fit_summary import fit_summary

    out.print(fit_summary(found, decay))
    console.print_files(files, out)


def say_report(findings: Findings, output: Path, overwrite: bool, json: bool) -> None:
    """Write the page of findings and print its summary."""
    from identification.report.page import write_report

    write_report(findings, output, overwrite=overwrite)
    sentences = findings.summary()
    content = {"file": str(output), "bytes": output.stat().st_size, "summary": sentences, **findings.to_dict()}

    def show(out: console.Console) -> None:
        for sentence in sentences:
            out.print(console.plain(sentence))
        console.print_files([str(output)], out)

    console.say(json, content, show)
