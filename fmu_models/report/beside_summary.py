"""What a run differs by from what was measured, for people and for programs."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from fmu_models.base.record import record
from fmu_models.base.table import number, table

if TYPE_CHECKING:
    from rich.console import Console

    from fmu_models.simulation.beside import Deviation


def summary(deviations: Sequence[Deviation], within: float | None) -> dict[str, Any]:
    """One row per column; ``within``: whether all of them are, None where nobody asked."""
    rows = [dataclasses.asdict(deviation) | {"share": record(deviation.share)} for deviation in deviations]
    return {
        "columns": rows,
        "within": None if within is None else all(deviation.share <= within for deviation in deviations),
    }


def print_summary(content: dict[str, Any], out: Console) -> None:
    """Print the comparison as a table."""
    keys = ("samples", "rms", "largest", "at", "span")
    shares = [None if row["share"] is None else 100 * row["share"] for row in content["columns"]]
    rows = [
        [row["variable"], row["column"], row["unit"], *(number(row[key], ".4g") for key in keys), number(share, ".3g")]
        for row, share in zip(content["columns"], shares, strict=True)
    ]
    heads = ("variable", "column", "unit", "samples", "rms", "largest", "at (s)", "measured span", "rms/span (%)")
    out.print(table("run less measurement", heads, rows))
    if content["within"] is False:
        out.print("Not within the deviation that was asked for.")
