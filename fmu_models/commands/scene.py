"""Command about scenes: list, show, run, and say what they leave out."""

from __future__ import annotations

import csv as csv_files
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.console import Json, Overwrite
from fmu_models.base.files import refuse_existing, write_whole
from fmu_models.base.table import number, table

if TYPE_CHECKING:
    from rich.console import Console

    from fmu_models.fmu.fmu import Fmu
    from fmu_models.scene.compute import Comparison
    from fmu_models.scene.kinds.kind import Row
    from fmu_models.scene.scene import Scene


@console.trusting
def scene(
    path: Annotated[
        str | None, typer.Argument(metavar="SCENE", help="A TOML file, or the name of a scene. [default: list them]")
    ] = None,
    explain: Annotated[
        bool, typer.Option("--explain", help="List what is left out and why, and measure what that saves.")
    ] = False,
    csv: Annotated[Path | None, typer.Option(help="Write the results as CSV.")] = None,
    figure: Annotated[
        Path | None, typer.Option(help="Draw the phase portraits, or the families (png, svg, pdf).")
    ] = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Show a scene, compute what it asks for, and compare that with what is known; exit with 1 if it differs.

    Example: stickslip scene disc_rig_class_a --explain
    """
    if path is None:
        _list(json)
        return
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.scene.compute import compare, compute
    from fmu_models.scene.read import read_scene
    from fmu_models.scene.reduce import built_scene

    refuse_existing(csv, figure, overwrite=overwrite)
    if figure:
        from fmu_models.base.figures import check_format

        check_format(figure)
    read = read_scene(path)
    with console.progress("computing") as advance:
        fmu = Fmu.open(built_scene(read))
        rows = compute(read, fmu, advance)
    comparisons = compare(read, rows)
    if csv:
        _write_csv(csv, read, rows, overwrite)
    if figure:
        from fmu_models.report.scene_figure import draw_scene

        draw_scene(read, fmu, rows, figure, overwrite=overwrite)
    content: dict[str, Any] = {
        "scene": {**dataclasses.asdict(read), "lines": None},
        "results": [
            {"at": row.at, "values": {name: console.finite(value) for name, value in row.values.items()}}
            for row in rows
        ],
        "comparisons": [{**dataclasses.asdict(one), "passed": one.passed} for one in comparisons],
        "passed": all(one.passed for one in comparisons),
        "explained": _explained(read) if explain else None,
        "files": [str(file) for file in (csv, figure) if file],
    }

    def show(out: Console) -> None:
        _print_scene(read, fmu, out)
        _print_results(read, rows, out)
        _print_comparisons(comparisons, out)
        if explain:
            _print_explained(content["explained"], out)
        for file in content["files"]:
            out.print(f"written: {file}")

    console.say(json, content, show)
    if not content["passed"]:
        raise typer.Exit(1)


def _list(as_json: bool) -> None:
    from fmu_models.base.toml_document import read_document
    from fmu_models.scene.read import files

    documents = {file.stem: read_document(file) for file in files()}
    rows = [{"name": name, **{k: d.text(k) for k in ("title", "model", "source")}} for name, d in documents.items()]

    def show(out: Console) -> None:
        made = console.table("scene", "what it is", "model", "source")
        for row in rows:
            made.add_row(row["name"], row["title"], row["model"], row["source"])
        out.print(made)
        out.print("Run one:  stickslip scene SCENE")

    console.say(as_json, {"scenes": rows}, show)


def _explained(scene: Scene) -> dict[str, Any]:
    """What is left out, sizes and times of the scene's FMU and of that of its model."""
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.scene.explain import left_out
    from fmu_models.scene.measure import size, time_build, time_runs, time_start, whole_model
    from fmu_models.scene.reduce import built_scene

    with console.progress("measuring") as advance:
        parts = left_out(scene)
        sizes = {"scene": size(Fmu.open(built_scene(scene))), "model": size(whole_model(scene))}
        advance(0.1)
        runs = time_runs(scene)
        advance(0.4)
        start = {"scene": time_start(scene, False), "model": time_start(scene, True)}
        advance(0.6)
        build = {"scene": time_build(scene, False), "model": time_build(scene, True)}
    return {
        "left_out": [dataclasses.asdict(part) for part in parts],
        "sizes": {name: dataclasses.asdict(one) for name, one in sizes.items()},
        "build_seconds": build,
        "start_seconds": start,
        "run_seconds": {"scene": runs.scene, "model": runs.model},
        "faster": runs.faster,
        "difference": runs.difference,
        "muted": dict(runs.muted),
    }


def _print_scene(scene: Scene, fmu: Fmu, out: Console) -> None:
    out.print(f"[bold]{scene.name}[/bold] ", console.plain(scene.title))
    out.print(f"source: {scene.source}", markup=False)
    inputs = ", ".join(
        f"{name} = {drive.constant:g}" if drive.constant is not None else f"{name} varies"
        for name, drive in scene.drives.items()
    )
    free = ", ".join(f"{name} = {value:g}" for name, value in scene.free.items())
    said = {
        "model": scene.model,
        "contacts": ", ".join(fmu.contacts) or "none",
        "drives": inputs or "none",
        "free": free or "no parameter; all are constants of the code",
        "outputs": ", ".join(scene.outputs) or "none beside the states",
        "run": f"to t = {scene.stop_time:g} s",
    }
    for what, text in said.items():
        out.print(f"  {what:10s} {text}", markup=False)


def _print_results(scene: Scene, rows: tuple[Row, ...], out: Console) -> None:
    if rows[0].family is not None and rows[0].family is rows[-1].family:
        out.print(rows[0].family.summary(), markup=False, highlight=False)
        if len(rows) > 1:  # a sweep: its rows are for a file
            return
    names = list(dict.fromkeys(name for row in rows for name in row.values))
    over = scene.compute.over
    title = f"{scene.compute.kind}{f' over {over}' if over else ''}"
    heads = ("result", *("" if row.at is None else f"{over} = {row.at:g}" for row in rows))
    values = ([name, *(number(row.values.get(name), ".10g") for row in rows)] for name in names)
    made = table(title, heads, values)
    out.print(made.turned() if len(rows) > len(names) else made)


def _print_comparisons(comparisons: tuple[Comparison, ...], out: Console) -> None:
    if not comparisons:
        return
    made = console.table(
        "known value", ">at", ">known", ">found", ">error", ">allowed", "", title="against what is known"
    )
    for one in comparisons:
        at = "" if one.at is None else f"{one.at:g}"
        numbers = (f"{one.known:.13g}", f"{one.found:.13g}", f"{one.error:.1e}", f"{one.tolerance:.0e}")
        made.add_row(one.name, at, *numbers, "" if one.passed else "differs")
    out.print(made)


def _print_explained(content: dict[str, Any], out: Console) -> None:
    made = console.table("left out", "name", "why", title="what the scene's FMU does without")
    for part in content["left_out"]:
        made.add_row(part["kind"], part["name"], part["why"])
    out.print(made)
    made = console.table("measured now", ">scene", ">whole model", ">saved", title="what that saves")
    sizes = content["sizes"]
    for what in sizes["scene"]:
        a, b = sizes["scene"][what], sizes["model"][what]
        unit = " kB" if what == "bytes" else ""
        a, b = (a / 1000, b / 1000) if what == "bytes" else (a, b)
        made.add_row("FMU file" if what == "bytes" else what, f"{a:.0f}{unit}", f"{b:.0f}{unit}", f"{b - a:.0f}{unit}")
    times = {
        "first result, nothing built": ("build_seconds", 1.0, "s"),
        "first result, FMU built before": ("start_seconds", 1.0, "s"),
        "time per run": ("run_seconds", 1e3, "ms"),
    }
    for what, (key, factor, unit) in times.items():
        a, b = (content[key][which] * factor for which in ("scene", "model"))
        made.add_row(what, f"{a:.3g} {unit}", f"{b:.3g} {unit}", f"{b / a:.2f} times faster")
    out.print(made)
    if content["difference"] is None:
        out.print("Contacts that are left out cannot be switched off in the whole model: its runs are another motion.")
    else:
        muted = ", ".join(content["muted"])
        off = f", with {muted} = 0 to switch off what is left out" if muted else ""
        out.print(
            f"The whole model makes the same motion{off}: states differ by {content['difference']:.1e} of their size."
        )


def _write_csv(path: Path, scene: Scene, rows: tuple[Row, ...], overwrite: bool) -> None:
    names = list(dict.fromkeys(name for row in rows for name in row.values))
    with (
        write_whole(path, overwrite=overwrite) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        writer = csv_files.writer(file, lineterminator="\n")
        writer.writerow([*([scene.compute.over] if scene.compute.over else []), *names])
        for row in rows:
            at = [repr(row.at)] if scene.compute.over else []
            writer.writerow([*at, *(repr(row.values[name]) if name in row.values else "" for name in names)])
