"""Comparisons as a table, JSON, CSV and one page that needs nothing but itself."""

from __future__ import annotations

import csv
import math
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fmu_models.base import console
from fmu_models.base.files import write_whole
from fmu_models.base.record import record
from fmu_models.base.table import Cell, PrintedColumn, PrintedTable, table
from fmu_models.validation.bench.run import MethodComparison, MethodRow

CAPTION = (
    "Error: largest difference of a state at the end, in its nominal value; '<' where it is no larger than three times "
    "what the reference itself may be wrong, so that it does not rank. "
    "Missed, extra: events of the reference without counterpart, events without one there. Time: of the whole call its "
    "user makes, without what a first call does once; median and distance of quartiles of calls in turn; 'of ours': "
    "median of the ratios of pairs. Memory: peak of Python's allocations."
)


# head, unit, and when a narrow terminal spares it
COLUMNS: tuple[tuple[Any, ...], ...] = (
    *(("method",), ("tolerance",), ("error",), ("missed",), ("right-hand sides", "", 1), ("time", "s")),
    *(("of ours", "", 2), ("event time error", "s", 4), ("extra", "", 7), ("spread", "s", 6)),
    *(("runs", "", 8), ("memory", "kB", 5)),
)


def as_json(comparisons: Sequence[MethodComparison]) -> dict[str, Any]:
    """Everything, for machines; numbers that are not finite become null."""
    return {"machine": machine(), "scenes": record(comparisons)}


def machine() -> str:
    """Where the times were measured."""
    return f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}"


def comparison_table(comparison: MethodComparison) -> PrintedTable:
    """A row for each method and tolerance."""
    columns = [PrintedColumn(*column) for column in COLUMNS]
    return table(f"{comparison.title} ({comparison.stop_time:g} s)", columns, map(_cells, comparison.rows))


def _cells(row: MethodRow) -> list[str | Cell]:
    events = row.events
    ratio = "-" if row.ratio is None else f"{row.ratio:.0f}" if row.ratio >= 100.0 else f"{row.ratio:.2g}"
    words = (
        f"{row.tolerance:.0e}",
        f"{'' if row.ranked else '<'}{row.error:.1e}" if math.isfinite(row.error) else "none",
        "-" if events is None else f"{events.missed} of {events.expected}",
        "-" if row.evaluations is None else str(row.evaluations),
        f"{row.seconds:.1e}",
        ratio,
        "-" if events is None or events.time is None else f"{events.time:.1e}",
        "-" if events is None else str(events.extra),
        f"{row.spread:.0e}",
        str(row.runs),
        "-" if row.memory is None else f"{row.memory / 1000:.0f}",
    )
    return [row.method, *(Cell(text, "number") for text in words)]


def print_table(comparisons: Sequence[MethodComparison], out: console.Console) -> None:
    """For people at a terminal."""
    for comparison in comparisons:
        out.print(comparison_table(comparison))
        out.print(f"Reference: {comparison.reference}.", markup=False)
        if comparison.shortened:
            out.print(comparison.shortened)
        for why, names in _grouped(comparison).items():
            out.print(console.plain(", ".join(names), "bold"), console.plain(f": {why}"), sep="")
        if comparison.interrupted:
            out.print("Interrupted: not everything was run.")
        out.print(f"{comparison.seconds:.0f} s in all\n")
    out.print(CAPTION)


def _grouped(comparison: MethodComparison) -> dict[str, list[str]]:
    """Methods without a result, by the reason."""
    groups: dict[str, list[str]] = {}
    for refusal in comparison.refusals:
        groups.setdefault(refusal.why, []).append(refusal.method)
    return groups


def write_csv(comparisons: Sequence[MethodComparison], path: Path, *, overwrite: bool) -> None:
    """One line per scene, method and tolerance, numbers in full. StickslipError: the file exists or cannot be
    written."""
    fields = [
        *("scene", "method", "family", "tolerance", "error [1]", "ranked", "events", "missed", "extra"),
        *("event time error [s]", "right-hand sides", "median [s]", "spread [s]", "of ours [1]", "runs", "memory [B]"),
    ]
    with write_whole(path, overwrite=overwrite) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(fields)
        for comparison in comparisons:
            for row in comparison.rows:
                e = row.events
                events = (None,) * 4 if e is None else (e.expected, e.missed, e.extra, e.time)
                writer.writerow([
                    comparison.name, row.method, row.family, row.tolerance, row.error, row.ranked, *events,
                    row.evaluations, row.seconds, row.spread, row.ratio, row.runs, row.memory,
                ])  # fmt: skip


def write_page(comparisons: Sequence[MethodComparison], path: Path, *, overwrite: bool) -> None:
    """One HTML file with diagrams and tables inside; it asks the network for nothing. StickslipError: the file exists
    or cannot be written."""
    from fmu_models.report.document import document, paragraph

    sections = [
        part for number, comparison in enumerate(comparisons) for part in _section(comparison, f"scene{number}")
    ]
    sections.append(paragraph(CAPTION, "about"))
    text = document("Error against run time", f"measured on {machine()}", sections, broad=True)
    with write_whole(path, overwrite=overwrite) as temporary:
        temporary.write_text(text, "utf-8")


def _section(comparison: MethodComparison, prefix: str) -> list[str]:
    from fmu_models.report.document import bullets, drawing, paragraph, section
    from fmu_models.validation.bench.diagram import draw

    failed = [f"{', '.join(names)}: {why}" for why, names in _grouped(comparison).items()]
    events = "" if comparison.expected is None else f" {comparison.expected} events."
    caption = f"{comparison.title}: error against cost by method"
    said = [f"{comparison.name}, {comparison.stop_time:g} s.{events} Reference: {comparison.reference}."]
    said += [comparison.shortened] if comparison.shortened else []
    said += ["Interrupted: not everything was run."] if comparison.interrupted else []
    parts = [
        *map(paragraph, said),
        drawing(draw(comparison), prefix, caption) if comparison.rows else paragraph("No method has finished."),
        comparison_table(comparison).html(),
        *(["<h3>Without a result</h3>", bullets(failed)] if failed else []),
    ]
    return [section(f"{prefix}-section", comparison.title, parts, folded=False)]
