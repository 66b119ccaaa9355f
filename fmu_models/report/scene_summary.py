"""What a scene is and what it computed, for people and as a table of numbers."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fmu_models.base import console
from fmu_models.base.files import write_whole
from fmu_models.base.table import number, table

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.scene.compute import Comparison
    from fmu_models.scene.kinds.kind import Row
    from fmu_models.scene.scene import Scene


def print_scene(scene: Scene, fmu: Fmu, out: console.Console) -> None:
    out.print(f"[bold]{scene.name}[/bold] ", console.plain(scene.title))
    out.print(f"source: {scene.source}", markup=False)
    inputs = ", ".join(
        f"{name} = {drive.constant:g}" if drive.constant is not None else f"{name} varies"
        for name, drive in scene.drives.items()
    )
    free = ", ".join(f"{name} = {value:g}" for name, value in scene.free.items())
    texts = {
        "model": scene.model,
        "contacts": ", ".join(fmu.contacts) or "none",
        "drives": inputs or "none",
        "free": free or "no parameter; all are constants of the code",
        "outputs": ", ".join(scene.outputs) or "none beside the states",
        "run": f"to t = {scene.stop_time:g} s",
        **({"departs": departure(scene)} if scene.departs else {}),
    }
    for label, text in texts.items():
        out.print(f"  {label:10s} {text}", markup=False)


def departure(scene: Scene) -> str:
    """Constants that are others than the file of the scene says; empty where none is."""
    return ", ".join(f"{name} = {scene.constants[name]:g}, not {known:g}" for name, known in scene.departs.items())


def print_results(scene: Scene, rows: tuple[Row, ...], out: console.Console) -> None:
    families = {id(row.family): row for row in rows if row.family is not None}
    if len(families) == 1 or 0 < len(families) < len(rows):
        for row in families.values():
            panel = "".join(f"{name} = {row.panel:g}: " for name in scene.compute.panels)
            assert row.family is not None
            out.print(f"{panel}{row.family.summary()}", markup=False, highlight=False)
        if len(rows) > 1:  # a sweep: its rows are for a file
            return
    names = list(dict.fromkeys(name for row in rows for name in row.values))
    over = scene.compute.over
    title = f"{scene.compute.kind}{f' over {over}' if over else ''}"
    heads = ("result", *("" if row.at is None else f"{over} = {row.at:g}" for row in rows))
    values = ([name, *(number(row.values.get(name), ".10g") for row in rows)] for name in names)
    results = table(title, heads, values)
    out.print(results.turned() if len(rows) > len(names) else results)


def print_comparisons(comparisons: tuple[Comparison, ...], out: console.Console) -> None:
    if not comparisons:
        return
    rows = [
        [
            comparison.name,
            ", ".join(f"{value:g}" for value in (comparison.panel, comparison.at) if value is not None),
            f"{comparison.known:.13g}",
            f"{comparison.found:.13g}",
            "" if comparison.departs else f"{comparison.error:.1e}",
            f"{comparison.tolerance:.0e}",
            "not compared: departs" if comparison.departs else "" if comparison.passed else "differs",
        ]
        for comparison in comparisons
    ]
    out.print(
        table("against what is known", ("known value", ">at", ">known", ">found", ">error", ">allowed", ""), rows)
    )


def print_explained(content: dict[str, Any], out: console.Console) -> None:
    parts = [[row["kind"], row["name"], row["why"]] for row in content["left_out"]]
    out.print(table("what the scene's FMU does without", ("left out", "name", "why"), parts))
    sizes, rows = content["sizes"], []
    for quantity in sizes["scene"]:
        a, b = sizes["scene"][quantity], sizes["model"][quantity]
        unit = " kB" if quantity == "bytes" else ""
        a, b = (a / 1000, b / 1000) if quantity == "bytes" else (a, b)
        label = "FMU file" if quantity == "bytes" else quantity
        rows.append([label, f"{a:.0f}{unit}", f"{b:.0f}{unit}", f"{b - a:.0f}{unit}"])
    out.print(table("what that saves", ("", ">scene", ">whole model", ">saved"), rows))


def write_csv(path: Path, scene: Scene, rows: tuple[Row, ...], overwrite: bool) -> None:
    names = list(dict.fromkeys(name for row in rows for name in row.values))
    with write_whole(path, overwrite=overwrite) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*scene.compute.panels, *([scene.compute.over] if scene.compute.over else []), *names])
        for row in rows:
            at = [*(repr(row.panel) for _ in scene.compute.panels), *([repr(row.at)] if scene.compute.over else [])]
            writer.writerow([*at, *(repr(row.values[name]) if name in row.values else "" for name in names)])
