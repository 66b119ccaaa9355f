"""A track in tables and words, and drawn over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.console import plain
from fmu_models.base.table import PrintedTable, known_to, sd, table
from identification.calibration.track import Course, Path
from identification.report.calibration_summary import residuals_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rich.console import Group

BLUE = "#0072b2"


def course_report(course: Course) -> Group:
    """Everything that a track says, without the courses."""
    from rich.console import Group

    parts = [ends_table(course), residuals_table(course.residuals)]
    return Group(plain(course.title, "bold"), *parts, *(plain(f"- {text}") for text in course.sentences))


def ends_table(course: Course) -> PrintedTable:
    """Parameters and states at the begin, in the middle and at the end."""
    rows = []
    for path in (*course.parameters, *course.states):
        ends = (0, len(path.values) // 2, -1)
        cells = [cell for n in ends for cell in (known_to(path.values[n], path.deviations[n]), sd(path.deviations[n]))]
        rows.append([path.name, *cells, path.unit if path.unit != "1" else ""])
    columns = ["of", "at first", "sd", "in the middle", "sd", "at last", "sd", "unit"]
    return table(f"Along {course.log}, {course.steps}", columns, rows)


def draw_course(course: Course, axes: Axes) -> None:
    """What drifts over time, with two deviations to either side; the first state where nothing does."""
    if course.parameters:
        for place, path in enumerate(course.parameters):
            _band(axes, (*course.nodes, course.times[-1]), path, f"C{place}", steps=True)
        axes.set_ylabel(", ".join(f"{path.name} ({path.unit})" for path in course.parameters))
    else:
        path = course.states[0]
        if path.name in course.measured:
            axes.plot(course.times, course.measured[path.name], ".", color="0.6", markersize=3, label="measured")
        _band(axes, course.times, path, BLUE, steps=False)
        axes.set_ylabel(f"{path.name} ({path.unit})")
    axes.set_xlabel("time (s)")
    axes.legend(frameon=False)


def _band(axes: Axes, times: Sequence[float], path: Path, colour: str, steps: bool) -> None:
    values, reach = np.array(path.values), 2 * np.array(path.deviations)
    if steps:  # a value holds until the next node
        values, reach = np.append(values, values[-1]), np.append(reach, reach[-1])
    axes.fill_between(
        times, values - reach, values + reach, color=colour, alpha=0.25, linewidth=0, step="post" if steps else None
    )
    axes.plot(times, values, color=colour, label=f"{path.name}, 2 sd", drawstyle="steps-post" if steps else "default")
