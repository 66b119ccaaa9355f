"""What a scene is and what it computed, for people and as a table of numbers."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fmu_models.base import console
from fmu_models.base.files import write_whole
from fmu_models.base.table import number, table

if TYPE_CHECKING:
    from rich.console import Console

    from fmu_models.fmu.fmu import Fmu
    from fmu_models.scene.compute import Comparison
    from fmu_models.scene.kinds.kind import Row
    from fmu_models.scene.scene import Scene


def print_scene(scene: Scene, fmu: Fmu, out: Console) -> None:
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


def print_results(scene: Scene, rows: tuple[Row, ...], out: Console) -> None:
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


def print_comparisons(comparisons: tuple[Comparison, ...], out: Console) -> None:
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


def print_explained(content: dict[str, Any], out: Console) -> None:
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


def write_csv(path: Path, scene: Scene, rows: tuple[Row, ...], overwrite: bool) -> None:
    names = list(dict.fromkeys(name for row in rows for name in row.values))
    with (
        write_whole(path, overwrite=overwrite) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*([scene.compute.over] if scene.compute.over else []), *names])
        for row in rows:
            at = [repr(row.at)] if scene.compute.over else []
            writer.writerow([*at, *(repr(row.values[name]) if name in row.values else "" for name in names)])
