"""Command that compares methods of integration."""

from pathlib import Path
from typing import Annotated

import typer

from fmu_models.base import console
from fmu_models.base.figures import check_files

DEFAULT = ["discontinuous_support_table_1"]


@console.trusting
def bench(
    scenes: Annotated[
        list[str] | None,
        typer.Argument(metavar="SCENE...", help=f"Scenes (files or names) or models. [default: {DEFAULT[0]}]"),
    ] = None,
    until: Annotated[float | None, typer.Option(help="End of the run, s. [default: as the scene says]")] = None,
    method: Annotated[
        list[str] | None, typer.Option(metavar="WORD", help="Only methods with this word in their name; repeatable.")
    ] = None,
    page: Annotated[Path | None, typer.Option(help="Write one self-contained HTML page with diagrams.")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Write every row as CSV.")] = None,
    figure: Annotated[Path | None, typer.Option(help="Draw the diagram of one scene (svg, png, pdf).")] = None,
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Compare methods of integration on scenes: error against run time, events missed, memory.

    An interrupt ends it early; what was finished is shown and written.

    Example: stickslip bench discontinuous_support_table_1 --page bench.html
    """
    from fmu_models.base.errors import StickslipError
    from fmu_models.validation.bench.output import as_json, print_table, write_csv, write_page
    from fmu_models.validation.bench.problems import problem
    from fmu_models.validation.bench.run import MethodComparison, compare
    from fmu_models.validation.methods.catalogue import chosen

    names = scenes or DEFAULT
    check_files(page, output, figures=[figure], overwrite=overwrite)
    if figure and len(names) > 1:
        raise StickslipError("--figure draws one scene; give one, or --page for all of them.")
    methods = chosen(method)
    comparisons: list[MethodComparison] = []
    stopped = False
    for i, name in enumerate(names):
        try:
            with console.progress(f"{name} ({i + 1} of {len(names)})") as advance:
                comparisons.append(compare(problem(name, until), methods, advance))
            stopped = comparisons[-1].interrupted
        except KeyboardInterrupt:
            stopped = True
        if stopped:
            break
    if output:
        write_csv(comparisons, output, overwrite=overwrite)
    if page:
        write_page(comparisons, page, overwrite=overwrite)
    if figure and comparisons:
        from fmu_models.base.figures import save_figure
        from fmu_models.validation.bench.diagram import draw

        save_figure(draw(comparisons[0]), figure, overwrite=overwrite)
    console.say(json, as_json(comparisons), lambda out: print_table(comparisons, out))
    if stopped:
        raise KeyboardInterrupt
