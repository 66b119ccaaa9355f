"""The figure of slip events: every event is marked and counted, and no panel lies on another."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from machine_log import FRICTION, recipe_of
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from identification.measurement.recipe import read_recipe
from identification.report.slip_report import slip_figure
from identification.slips.block_on_belt import Prediction, SlipModel
from identification.slips.events import SlipEvents
from identification.slips.statistics import SlipStatistics, slip_statistics
from rig_io.readers.csv_log import write

RECIPE = f"""title = "a saw"
{FRICTION}
[slips]
smoothing = "5 ms"
"""


@pytest.fixture(scope="module")
def slips(tmp_path_factory: pytest.TempPathFactory) -> tuple[SlipStatistics, SlipEvents]:
    """Of a saw of 20 teeth of several heights on 0.2, of which the last is not seen whole."""
    folder = tmp_path_factory.mktemp("slips")
    heights = np.tile([0.20, 0.22, 0.24, 0.21], 5)
    saw = 0.2 + np.concatenate([np.r_[np.linspace(0, up, 200), np.linspace(up, 0, 20)] for up in heights])
    write(folder / "log.csv", {"time": np.arange(len(saw)) * 1e-3, "f": saw})
    return slip_statistics(read_recipe(recipe_of(folder, RECIPE)), folder / "log.csv")


def marked(axes: Axes, label: str) -> np.ndarray:
    (line,) = (line for line in axes.lines if line.get_label() == label)
    return np.column_stack([np.asarray(line.get_xdata()), np.asarray(line.get_ydata())])


def test_the_upper_panels_mark_all_events_and_nine_in_the_middle(slips) -> None:
    statistics, events = slips
    count = len(events.time)
    assert count > 15
    whole, part, *_ = slip_figure(statistics, events, None).axes
    assert marked(whole, "peak") == pytest.approx(np.column_stack([events.time, events.peak]))
    assert marked(whole, "after slip") == pytest.approx(np.column_stack([events.end, events.after]))
    middle = slice(count // 2 - 4, count // 2 + 5)
    assert marked(part, "peak")[:, 0] == pytest.approx(events.time[middle])
    shown = np.asarray(part.lines[0].get_xdata())
    # from the first of them on, and on for a quarter of a period after the last has fallen
    assert shown[0] == pytest.approx(events.time[middle][0], abs=1.5e-3)
    assert shown[-1] == pytest.approx(events.end[middle][-1] + 0.22 / 4, abs=2.5e-3)
    assert (part.get_xlabel(), part.get_ylabel()) == ("time (s)", "force over weight (1)")


def test_the_lower_panels_count_every_event_beside_measured_and_modelled_values(slips) -> None:
    statistics, events = slips
    model = SlipModel(0.5, 0.4, 1e3, (Prediction("period", "s", 0.2, 0.25, False, False),), "")
    figure = slip_figure(statistics, events, model)
    peak, after, period = figure.axes[2:]
    assert [axes.get_xlabel() for axes in (peak, after, period)] == [
        "peak friction (1)", "friction after slip (1)", "period (s)"
    ]  # fmt: skip
    counted = [
        sum(bar.get_height() for bar in axes.patches if isinstance(bar, Rectangle)) for axes in (peak, after, period)
    ]
    assert counted == [len(events.time), len(events.time), len(events.time) - 1]
    labels = [handle.get_label() for axes in (peak, period) for handle in axes.get_legend_handles_labels()[0]]
    values = [f"measured {one.value:.4g}" for one in (statistics.peak, statistics.period)]
    assert labels == [*values, "model 0.25"]
    assert [float(np.asarray(line.get_xdata())[0]) for line in period.lines] == [statistics.period.value, 0.25]
    assert figure.get_suptitle() == f"a saw: {len(events.time)} slip events"


def test_no_panel_lies_on_another(slips) -> None:
    statistics, events = slips
    figure = slip_figure(statistics, events, None)
    figure.draw_without_rendering()
    places = [axes.get_position() for axes in figure.axes]
    assert len(places) == 5
    for one, other in combinations(places, 2):
        assert one.x1 <= other.x0 or other.x1 <= one.x0 or one.y1 <= other.y0 or other.y1 <= one.y0
