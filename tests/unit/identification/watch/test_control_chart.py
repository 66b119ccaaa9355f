"""Control charts: how often they call a bench in order, and how soon one that has changed; when a file rests."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from identification.watch.chart import FIRST, control_chart
from identification.watch.logs import FileStates, rested
from identification.watch.state import FITTED, Entry, WatchState, read_state, write_state


def series(rng: np.random.Generator, length: int, begin: int, change: float) -> np.ndarray:
    """Values of unit deviation that change by so many of them from a log on."""
    return rng.standard_normal(length) + change * (np.arange(length) >= begin)


def test_the_limits_of_the_ewma_are_those_of_the_book() -> None:
    # Montgomery: target +- L s sqrt(w/(2 - w) (1 - (1 - w)^2i)); here w = 0.2, L = 3
    chart = control_chart([10.0, 10.0, 10.0, 10.0, 11.0], [0.5] * 5)
    assert (chart.target, chart.deviation) == (10.0, 0.5)
    assert chart.high[0] - 10 == pytest.approx(3 * 0.5 * 0.2)
    assert chart.high[4] - 10 == pytest.approx(1.5 * np.sqrt(1 / 9 * (1 - 0.8**10)))
    assert chart.level[4] == pytest.approx(10.2) and chart.sums[4] == pytest.approx(1.5)


def test_a_bench_in_order_is_seldom_called_and_a_changed_one_soon() -> None:
    rng = np.random.default_rng(2)
    calm = [control_chart(series(rng, 20, 99, 0.0), np.ones(20)).out.any() for _ in range(400)]
    # the target is the mean of four logs, which the limits do not know of
    assert np.mean(calm) < 0.25
    delays = []
    for _ in range(200):
        out = np.flatnonzero(control_chart(series(rng, 40, 8, 3.0), np.ones(40)).out)
        delays.append(out[out >= 8][0] - 8 if (out >= 8).any() else 99)
    assert np.median(delays) <= 4 and np.max(delays) < 30
    assert not control_chart(series(rng, FIRST, 0, 9.0), np.ones(FIRST)).out.any()


def test_a_file_counts_once_it_rests() -> None:
    small, grown = {"a.csv": (10, 1)}, {"a.csv": (20, 2)}
    ready, since = rested([FileStates("a.csv", small)], {}, 0.0, 3.0)
    assert ready == []
    ready, since = rested([FileStates("a.csv", grown)], since, 2.9, 3.0)
    ready, since = rested([FileStates("a.csv", grown)], since, 5.0, 3.0)
    assert ready == []
    ready, since = rested([FileStates("a.csv", grown)], since, 6.0, 3.0)
    assert [one.name for one in ready] == ["a.csv"]
    # gone and back is new
    _, since = rested([], since, 7.0, 3.0)
    assert rested([FileStates("a.csv", grown)], since, 8.0, 3.0)[0] == []


def test_a_state_survives_its_file(tmp_path) -> None:
    entry = Entry(
        "a.csv", {"a.csv": (10, 12345678901234567)}, "x", 1.5, FITTED, "", {"mu_s": (0.6, 0.1)}, ("laser",), ("w",)
    )
    state = WatchState("Conti", "shooting").with_entry(entry)
    write_state(tmp_path / "s.json", state)
    assert read_state(tmp_path / "s.json") == state and state.knows({"a.csv": (10, 12345678901234567)})
    assert not state.knows({"a.csv": (11, 12345678901234567)}) and state.twin("x") is entry
    for text in ("{", "[]", '{"type": "stickslip watch", "version": 1, "entries": [{}], "law": "", "estimator": ""}'):
        (tmp_path / "s.json").write_text(text)
        with pytest.raises(StickslipError, match=r"not the state of a watch.*--state FILE"):
            read_state(tmp_path / "s.json")
