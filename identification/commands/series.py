"""Command that says what motion a measured series is."""

from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.commands.bundles import bundled
from identification.commands.logs import ReaderOption
from identification.commands.recipes import Log, ResultFiles


@bundled
def series(
    log: Log,
    columns: Annotated[
        list[str] | None, typer.Option("--column", metavar="COLUMN", help="A series; repeat (default: all columns).")
    ] = None,
    time: Annotated[
        str | None, typer.Option("--time", metavar="COLUMN", help="Column of the times, where names do not tell.")
    ] = None,
    rate: Annotated[
        float | None, typer.Option("--rate", metavar="HZ", help="Samples a second of a log without times.", min=0)
    ] = None,
    delay: Annotated[
        int | None, typer.Option(help="Of the reconstruction, samples (default: by mutual information).", min=1)
    ] = None,
    dimension: Annotated[
        int | None, typer.Option(help="Of the reconstruction (default: by false neighbours).", min=2)
    ] = None,
    reader: ReaderOption = None,
    seed: Annotated[int, typer.Option(help="Of bootstrap and surrogates.", min=0)] = 0,
    *,
    files: ResultFiles,
) -> None:
    """Say what motion a measured series is: periodic, quasiperiodic, chaos (with its exponent), transient, or noise.

    With exponents by four methods, dimension, 0-1 test, surrogates and recurrence; or how long it should be.

    Example: stickslip series run.csv --column x --figure x.png
    """
    files.check()
    if files.figure and len(columns or ()) > 1:
        raise StickslipError(f"--figure draws one series, and {len(columns or ())} are asked for. Name one --column.")
    with console.warnings_said(), console.progress("reconstructing") as advance:
        from identification.report.series_report import series_figure, series_report
        from identification.series.analyse import series_invariants
        from identification.series.read import read_series

        read = read_series(log, columns or (), time=time, rate=rate, reader=reader)
        if files.figure and len(read) > 1:
            names = ", ".join(one.name.partition(": ")[2] for one in read)
            raise StickslipError(f"--figure draws one series, and the log has {names}. Name one --column.")
        results = []
        for place, one in enumerate(read):
            results.append(series_invariants(one, delay=delay, dimension=dimension, seed=seed))
            advance((place + 1) / len(read))
        files.draw(lambda: series_figure(results[0]))

    def report() -> object:
        from rich.console import Group

        return Group(*(series_report(one) for one in results))

    files.say({"series": results}, report)
