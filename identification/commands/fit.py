"""Command that fits a friction law."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.figures import check_files
from fmu_models.base.threads import one_blas_thread
from identification.commands.fits import (
    RATIOS,
    Disturbing,
    EstimatorName,
    FigurePath,
    decay_of,
    draw_friction,
    fit_logs,
    named,
    print_fit,
    sampled,
    write_text,
)
from identification.commands.logs import Logs, ReaderOption, Repairs, Uncertainties, read_logs, stated
from identification.inference.defaults import COVARIANCE, DISTURBANCES, DRAWS, ESTIMATOR, LAW, LAW_SPREAD, SEED

if TYPE_CHECKING:
    from identification.fit.result import FrictionFit
    from identification.measurement.pooled import Pool


def fit(
    logs: Logs,
    estimator: EstimatorName = ESTIMATOR,
    law: Annotated[str, typer.Option(help="Friction law: Conti, Tustin, ...; or your own, my_law.py.")] = LAW,
    settings: console.Settings = None,
    uncertainty: Uncertainties = None,
    repair: Repairs = None,
    reader: ReaderOption = None,
    free: Annotated[
        list[str] | None,
        typer.Option(
            "--free", metavar="NAME", help="Constant estimated beside the law: J, k/J, c/J, R, r, N, zero; repeat."
        ),
    ] = None,
    disturbances: Disturbing = DISTURBANCES,
    law_spread: Annotated[
        str,
        typer.Option(
            metavar="none|auto",
            help="Intervals hold the spread over laws that the logs cannot tell apart, by the free curve.",
        ),
    ] = LAW_SPREAD,
    covariance: Annotated[str, typer.Option(help="jackknife, hac or bootstrap.")] = COVARIANCE,
    bootstrap: Annotated[int, typer.Option(help="Draws of --covariance bootstrap.")] = DRAWS,
    seed: Annotated[int, typer.Option(help="Of the bootstrap and of the posterior.")] = SEED,
    profile: Annotated[bool, typer.Option("--profile", help="Intervals by profile likelihood.")] = False,
    posterior: Annotated[
        bool, typer.Option("--posterior", help="Sample what the logs leave open (MCMC), constants of the rig with it.")
    ] = False,
    corner: Annotated[
        Path | None, typer.Option("--corner", metavar="FILE", help="Draw the posterior, .png, .svg or .pdf.")
    ] = None,
    allow_no_stick: Annotated[bool, typer.Option("--allow-no-stick", help="Take logs that never stick.")] = False,
    result: Annotated[Path | None, typer.Option("--result", "-o", help="Write the fit as JSON.")] = None,
    figure: FigurePath = None,
    workers: Annotated[int | None, typer.Option(help="Threads (default: as many as there are cores).", min=1)] = None,
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Fit a friction law to stick-slip logs, all pooled; a free decay among them gives k/J and c/J.

    Example: stickslip fit data/rigs/paper_rubber --result fit.json --figure friction.png
    """
    from identification.estimators.base import Options
    from identification.fit.posterior import check_samplable
    from identification.fit.posterior import posterior as drawn_posterior
    from identification.inference.choice import Inference

    check_files(result, figures=(figure, corner), overwrite=overwrite)
    posterior = posterior or corner is not None
    if posterior:
        check_samplable(estimator)
    inference = Inference(covariance, bootstrap, seed, profile)
    # share of the work that comes before the fit, reading and pooling; a draw of a bootstrap costs a tenth of a fit
    begun = 0.02 if posterior else 0.1 if covariance == "bootstrap" or profile else 0.25
    ended = 0.1 if posterior else 0.98  # of the work: where the fit is there
    with one_blas_thread(), console.progress("fitting") as advance:
        said = stated(settings, uncertainty)
        read = read_logs(logs, said.without(RATIOS), repair, reader)
        decay = decay_of(read, said)
        advance(0.5 * begun)
        ready, found = fit_logs(
            read,
            decay,
            estimator=estimator,
            law=law,
            options=Options(tuple(free or ()), workers=workers),
            disturbances=named(disturbances),
            law_spread=law_spread,
            inference=inference,
            progress=lambda done: advance(begun + (ended - begun) * done),
            allow_no_stick=allow_no_stick,
        )
        advance(ended)
        if posterior:
            how: dict[str, Any] = {"seed": seed, "workers": workers}
            how["progress"] = lambda done: advance(ended + (0.98 - ended) * done)
            found = sampled(found, lambda: drawn_posterior(ready, found, **how))
        advance(0.98)
        files, interrupted = _kept(found, ready, {"result": result, "figure": figure, "corner": corner}, overwrite)
    decay = ready.decay  # of logs whose beam is another than described it is that of this beam
    content = {**found.to_dict(), "free_decay": decay.to_dict() if decay else None, "files": files}
    console.say(json, content, lambda out: print_fit(decay, found, files, out))
    if interrupted:
        raise typer.Exit(console.INTERRUPTED)


def _kept(found: FrictionFit, ready: Pool, paths: Mapping[str, Path | None], overwrite: bool) -> tuple[list[str], bool]:
    """Write what is asked for, the numbers first, so that an interrupt leaves what is finished; the files written, and
    whether there was one. paths: of "result", "figure" and "corner"."""
    from fmu_models.base.figures import save_figure
    from identification.report.posterior_figure import posterior_figure

    files = []
    result, figure, corner = paths["result"], paths["figure"], paths["corner"]
    if result:
        write_text(result, found.to_json(), overwrite)
        files.append(str(result))
    interrupted = found.interrupted
    try:
        if figure and not interrupted:
            draw_friction(found, ready, figure, overwrite)
            files.append(str(figure))
        if corner and found.posterior is not None:
            title = f"{found.law} law of {' and '.join(found.contacts)}"
            values = {one.name: one.value for one in (*found.parameters, *found.nuisance, *found.constants)}
            names = [one.name for one in found.parameters]
            save_figure(posterior_figure(found.posterior, title, values, names), corner, overwrite=overwrite)
            files.append(str(corner))
    except KeyboardInterrupt:
        interrupted = True
    return files, interrupted
