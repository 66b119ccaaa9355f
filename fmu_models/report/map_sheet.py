"""The motions of a map, for people."""

from __future__ import annotations

from typing import Any

from fmu_models.base import console
from fmu_models.base.digits import value_with_sd
from fmu_models.base.table import PrintedTable, table


def print_map(content: dict[str, Any], out: console.Console) -> None:
    out.print(f"[bold]{content['map']}[/bold]: {content['title']}{' (negative map)' if content['negative'] else ''}")
    out.print(f"Source: {content['source']}")
    for name, rule in content["rule"].items():
        out.print(f"  {name} <- {rule}")
    out.print("  " + ", ".join(f"{name} = {value:g}" for name, value in content["parameters"].items()))
    period = content["period"]
    heading = "Fixed points" if period == 1 else f"Motions of period {period}"
    where = ", ".join(f"{name} from {low:g} to {high:g}" for name, (low, high) in content["box"].items())
    if content["motions"]:
        out.print(_motion_table(content, f"{heading}, {where}"))
    else:
        out.print(f"{heading}: none found for {where}")
    if content.get("jumps"):
        jumps = [
            [
                *(f"{round(row[key], 9):.6g}" for key in ("x", "left", "right")),
                "crosses the diagonal; no fixed point" if row["crosses_diagonal"] else "",
            ]
            for row in content["jumps"]
        ]
        out.print(table(f"Jumps of the {_iterate(period)}", (">jump at", ">left", ">right", ""), jumps))
    if "bifurcations" in content:
        _print_bifurcations(content["bifurcations"], out)
    if "lyapunov" in content:
        exponents = content["lyapunov"]
        pairs = zip(exponents["exponents"], exponents["standard_errors"], strict=True)
        listing = ", ".join("-inf" if value is None else value_with_sd(value, error) for value, error in pairs)
        out.print(f"Lyapunov exponents: {listing} per step, from {exponents['steps']} steps")


def _iterate(period: int) -> str:
    return "map" if period == 1 else f"map applied {period} times"


def _motion_table(content: dict[str, Any], title: str) -> PrintedTable:
    states, motions = list(content["rule"]), []
    for motion in content["motions"]:
        values = "\n".join(_complex(eigenvalue) for eigenvalue in motion["eigenvalues"])
        verdict = "stable" if motion["stable"] else "unstable" if motion["hyperbolic"] else "undecided"
        columns = ("\n".join(f"{point[name]:.10g}" for point in motion["points"]) for name in states)
        motions.append([*columns, values, "\n".join(motion["classes"]), verdict])
    return table(title, (*(f">{name}" for name in states), ">eigenvalues", "class", ""), motions)


def _print_bifurcations(rows: list[dict[str, Any]], out: console.Console) -> None:
    if not rows:
        out.print("On the way these motions meet neither a saddle-node nor a flip.")
        return
    bifurcations = [
        [
            row["parameter"],
            f"{row['value']:.14g}",
            row["kind"],
            ", ".join(f"{name} {value:.6g}" for name, value in row["points"][0].items()),
        ]
        for row in rows
    ]
    out.print(table("On the way", ("parameter", ">value", "what", "at"), bifurcations))


def _complex(eigenvalue: dict[str, float]) -> str:
    if eigenvalue["imag"] == 0:
        return f"{eigenvalue['real']:.8g}"
    return f"{eigenvalue['real']:.6g} {'+' if eigenvalue['imag'] > 0 else '-'} {abs(eigenvalue['imag']):.6g}i"
