"""The page of a watch: which logs it shows, in what order, and what its figure says."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.dates import date2num
from matplotlib.figure import Figure

from identification.watch.chart import control_chart
from identification.watch.page import draw_value, watch_table, write_page
from identification.watch.state import FITTED, REFUSED, Entry, WatchState

MU = (0.60, 0.61, 0.59, 0.60, 0.70)
BEGIN = datetime.datetime(2024, 5, 6, 7, 8, 9, tzinfo=datetime.UTC).timestamp()
CALL = "mu_s is 0.7, beyond <its> limits"


def entry(number: int, **other: object) -> Entry:
    values = {"mu_s": (MU[number], 0.01), "mu_k": (MU[number] - 0.1, 0.02), "p": (2.0 + number, 0.5)}
    return Entry(f"run{number}.csv", {}, f"{number}", BEGIN + 60 * number, FITTED, values=values, **other)  # type: ignore[arg-type]


@pytest.fixture
def state() -> WatchState:
    """Five fitted logs, the last of which is called, known in another order than they were recorded; one refused."""
    refused = Entry("bad.csv", {}, "x", BEGIN + 30, REFUSED, "no angle")
    return WatchState(
        "Conti", "shooting", (entry(4, calls=(CALL,)), refused, *(entry(number) for number in (0, 2, 1, 3)))
    )


def drawn(state: WatchState, name: str) -> Axes:
    axes = Figure().subplots()
    draw_value(state, name, axes)
    return axes


def test_a_value_is_drawn_over_the_time_of_its_logs(state: WatchState) -> None:
    panels = [drawn(state, name) for name in ("mu_s", "mu_k", "p")]
    assert [panel.get_ylabel() for panel in panels] == ["mu_s", "mu_k", "p (s/m)"]
    assert {panel.get_xlabel() for panel in panels} == {"time (UTC)"}
    (points, _, (bars,)) = panels[0].containers[0]  # type: ignore[misc]
    assert points.get_ydata() == pytest.approx(MU)
    days = date2num([datetime.datetime.fromtimestamp(BEGIN + 60 * k, datetime.UTC) for k in range(5)])
    assert points.get_xdata() == pytest.approx(days, abs=1e-6)
    ends = np.array([segment[:, 1] for segment in bars.get_segments()])
    assert ends == pytest.approx(np.array([(mu - 0.0196, mu + 0.0196) for mu in MU]))


def test_the_log_that_left_its_limits_is_marked(state: WatchState) -> None:
    chart = control_chart(MU, [0.01] * 5)
    assert list(np.flatnonzero(chart.out)) == [4]  # 10 deviations from the mean of the four before it
    mu_s, mu_k = drawn(state, "mu_s"), drawn(state, "mu_k")
    lines = {str(line.get_label()): line for line in mu_s.lines}
    assert lines["out"].get_ydata() == pytest.approx([MU[4]])
    assert lines["EWMA"].get_ydata() == pytest.approx(chart.level)
    (limits,) = (one for one in mu_s.collections if one.get_label() == "limits")
    low, high = limits.get_datalim(mu_s.transData).intervaly
    assert (low, high) == pytest.approx((min(chart.low), max(chart.high)))
    assert {"log, 95 % (noise)", "EWMA", "limits", "out"} == {t.get_text() for t in mu_s.get_legend().get_texts()}  # type: ignore[union-attr]
    assert [str(line.get_label()) for line in mu_k.lines].count("out") == 1


def test_the_table_has_the_latest_log_first_and_what_was_called_or_refused(state: WatchState) -> None:
    table = watch_table(state)
    rows = [[cell.words for cell in row] for row in table.rows]
    assert [row[1] for row in rows] == ["run4.csv", "run3.csv", "run2.csv", "run1.csv", "bad.csv", "run0.csv"]
    assert rows[0] == ["2024-05-06 07:12:09", "run4.csv", FITTED, "0.700", "0.600", "6.00", CALL]
    assert rows[4] == ["2024-05-06 07:08:39", "bad.csv", REFUSED, "", "", "", "no angle"]
    assert [cell.kind for cell in table.rows[4]].count("fail") == 1 and table.rows[0][-1].kind == "fail"
    assert [row[1].words for row in watch_table(state, 2).rows] == ["run4.csv", "run3.csv"]


def test_the_page_is_loaded_anew_and_holds_what_was_called_as_text(state: WatchState, tmp_path: Path) -> None:
    write_page(tmp_path / "watch.html", state, tmp_path, 0.2)
    text = (tmp_path / "watch.html").read_text("utf-8")
    assert "every 1 s" in text and "1000 * 1)" in text  # s, at least one
    assert "beyond &lt;its&gt; limits" in text and "<its>" not in text
    assert "Conti" in text and text.count("<svg") == 3
    write_page(tmp_path / "watch.html", WatchState("Conti", "shooting"), tmp_path, 12.4)
    text = (tmp_path / "watch.html").read_text("utf-8")
    assert "every 12 s" in text and "<svg" not in text
