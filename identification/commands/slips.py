"""Command that finds slip events in a log and compares their statistics with a model."""

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.commands.bundles import bundled
from identification.commands.logs import ReaderOption, Repairs
from identification.commands.recipes import Log, RecipeArgument, ResultFiles


@bundled
def slips(
    recipe: RecipeArgument,
    log: Log,
    settings: console.Settings = None,
    repair: Repairs = None,
    reader: ReaderOption = None,
    events: Annotated[
        str,
        typer.Option(
            help="What counts as a slip: large (beyond a share of the usual fall), or every fall beyond noise."
        ),
    ] = "large",
    seed: Annotated[int, typer.Option(help="Of the bootstrap.", min=0)] = 0,
    *,
    files: ResultFiles,
) -> None:
    """Find the slip events in a log of friction, and compare their statistics with a block on a belt.

    --set gives mass (kg), stiffness (N/m), speed (m/s), damping (N s/m), smoothing (s), share in place of the recipe's.

    Example: stickslip slips slider data/machines/slider.csv --set stiffness=50
    """
    from identification.measurement.recipe import read_recipe
    from identification.report.slip_report import slip_figure, slip_report
    from identification.slips.block_on_belt import fit_slip_model
    from identification.slips.statistics import slip_statistics

    files.check()
    with console.warnings_said(), console.progress("looking for slips") as advance:
        constants = console.assignments(settings, "constant")
        asked = {"definition": events, "seed": seed, "reader": reader, "repair": console.names_of(repair)}
        statistics, found_events = slip_statistics(read_recipe(recipe), log, constants, **asked)
        advance(0.4)
        try:
            model, missing = fit_slip_model(statistics), ""
        except StickslipError as error:
            model, missing = None, str(error)
        advance(0.8)
        files.draw(lambda: slip_figure(statistics, found_events, model))
    content = {**statistics.to_dict(), "model": model.to_dict() if model else None}
    content |= {"no_model": missing, "table": found_events.to_dict()}

    files.say(content, lambda: slip_report(statistics, model, missing))
