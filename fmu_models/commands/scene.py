"""Command about scenes: list, show, run, and say what they leave out."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.figures import check_files
from fmu_models.base.record import record


@console.trusting
def scene(
    path: Annotated[
        str | None, typer.Argument(metavar="SCENE", help="A TOML file, or the name of a scene. [default: list them]")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Another value of a constant, 0.1 or '3 mm'; repeat."),
    ] = None,
    explain: Annotated[
        bool, typer.Option("--explain", help="List what is left out and why, and how much smaller that is.")
    ] = False,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Write the results as CSV.")] = None,
    figure: Annotated[
        Path | None, typer.Option(help="Draw the phase portraits, or the families (png, svg, pdf).")
    ] = None,
    overwrite: console.Overwrite = False,
    json: console.Json = False,
) -> None:
    """Show a scene, compute what it asks for, and compare that with what is known; exit with 1 if it differs.

    With constants of your own it departs from what is known, and nothing is compared.

    Example: stickslip scene disc_rig_class_a --explain
    """
    constants = dict(console.pairs(settings, "--set", "NAME=VALUE, such as f=0.402"))
    if path is None:
        _list(json)
        return
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.report import scene_summary
    from fmu_models.scene.compute import compare, compute
    from fmu_models.scene.left_out import explained
    from fmu_models.scene.read import read_scene
    from fmu_models.scene.reduce import built_scene

    check_files(output, figures=[figure], overwrite=overwrite)
    read = read_scene(path, constants)
    with console.progress("computing") as advance:
        fmu = Fmu.open(built_scene(read))
        rows = compute(read, fmu, advance)
    comparisons = compare(read, rows)
    told = explained(read) if explain else None
    if output:
        scene_summary.write_csv(output, read, rows, overwrite)
    if figure:
        from fmu_models.report.scene_figure import draw_scene

        draw_scene(read, fmu, rows, figure, overwrite=overwrite)
    content: dict[str, Any] = {
        "scene": {**dataclasses.asdict(read), "lines": None},
        "results": [{"panel": row.panel, "at": row.at, "values": record(row.values)} for row in rows],
        "comparisons": [record(comparison) | {"passed": comparison.passed} for comparison in comparisons],
        "passed": all(comparison.passed for comparison in comparisons),
        "explained": told,
        "files": [str(file) for file in (output, figure) if file],
    }

    def show(out: console.Console) -> None:
        scene_summary.print_scene(read, fmu, out)
        scene_summary.print_results(read, rows, out)
        scene_summary.print_comparisons(comparisons, out)
        if told:
            scene_summary.print_explained(told, out)
        console.print_files(content["files"], out)

    console.say(json, content, show)
    if not content["passed"]:
        raise typer.Exit(1)


def _list(as_json: bool) -> None:
    from fmu_models.base.shipped import scenes
    from fmu_models.base.toml_document import read_document

    documents = {file.stem: read_document(file) for file in scenes()}
    rows = [
        {"name": name, "title": d.text("title"), "model": d.text("model")}
        | {"source": d.text("source", default="as its model says")}
        for name, d in documents.items()
    ]

    def show(out: console.Console) -> None:
        lines = [[row[key] for key in ("name", "title", "model", "source")] for row in rows]
        out.print(console.table("", ("scene", "what it is", "model", "source"), lines))
        out.print("Run one:  stickslip scene SCENE")

    console.say(as_json, {"scenes": rows}, show)
