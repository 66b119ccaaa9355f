"""Basins over a parameter: shares against exact ones, names and tipping points against closed forms."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom
from wells import well

from fmu_models import Iteration, Map, Parameter, State, StickslipError, Strobe, basin_shares, load
from fmu_models.analyses.shares import BasinShares
from fmu_models.families.execution import Execution
from fmu_models.families.store import stored_runs

ALONE = Execution(workers=1)


def cubic() -> Iteration:
    x, a = State("x", "1", "x", start=0.5), Parameter("a", 1.5, "1", "a")
    rule: Any = {x: a * x - x**3}
    return Iteration.of(Map(name="cubic", title="cubic", source="here", states=[x], rule=rule, box={x: (-2.0, 2.0)}))


def over(values: Any, **others: Any) -> BasinShares:
    return basin_shares(cubic(), "a", values, **{"box": {"x": (-1.2, 1.2)}, "execution": ALONE, **others})


@cache
def support() -> Strobe:
    return Strobe(load("discontinuous_support"), forcing="omega", parameters={"ks": 10.0})


def over_frequency(values: Any, **others: Any) -> BasinShares:
    box: Any = {"x": (-8.0, 8.0), "v": (-8.0, 8.0)}
    return basin_shares(support(), "omega", values, **{"box": box, "execution": ALONE, **others})


def test_names_last_through_flips_chaos_and_merging():
    """x -> a x - x^3: two mirror motions, which flip at 2, become chaos, merge at 3 sqrt(3)/2, and are lost at 3."""
    values = [1.6, 2.0, 2.1, 2.27, 2.4, 2.55, 2.65, 3.05]
    found = over(values, starts=40, most=300)
    assert [(tip.kind, tip.name, tip.into) for tip in found.tips] == [("merged", 1, 0), ("lost", 0, -1)]
    assert found.tips[0].value == pytest.approx(1.5 * math.sqrt(3.0), abs=1e-4)
    assert found.tips[1].value == pytest.approx(3.0, abs=1e-4)
    assert found.counts.shape[1] == 2 + 3, "no name is wasted"
    assert {"1", "2", "4", "chaos"} <= {word for row in found.words for word in row}
    assert (found.counts.sum(axis=1) == 40).all()
    beyond = found.values > 3.0
    assert (found.counts[beyond, found.names.index("to infinity")] == 40).all()


def test_intervals_cover_what_mirrors_share_evenly():
    """Each has a half, by symmetry, until they merge: of 95 % intervals that many hold it, as binomials scatter."""
    found = over(np.linspace(1.51, 1.98, 200), starts=50)
    held = (found.low[:, 0] <= 0.5) & (found.high[:, 0] >= 0.5)
    low, high = (float(binom.ppf(p, 200, 0.95)) for p in (0.001, 0.999))
    assert low - 2 <= held.sum() <= high + 2
    # of Wilson's interval for 8 of 10
    ten = BasinShares("m", "a", np.zeros(1), 10, np.array([[8, 2, 0, 0, 0]]), (("1", "1"),), ())
    assert (ten.low[0, 0], ten.high[0, 0]) == pytest.approx((0.4901625, 0.9433178), abs=1e-6)
    assert ten.high[0, 2] == pytest.approx(0.2775328, abs=1e-6) and ten.low[0, 2] == 0.0


def test_folds_are_solved_for():
    """The support at ks = 10 (1.193153181280957, as in test_families), down and up; the shares of figure 6 at 1.18."""
    up = over_frequency([1.16, 1.18, 1.2], starts=400)
    (tip,) = up.tips
    assert tip.kind == "lost" and tip.fold and tip.value == pytest.approx(1.193153181280957, abs=1e-10)
    assert up.words[1][tip.name] == "1-1"
    assert up.low[1, tip.name] < 3181 / 10201 < up.high[1, tip.name]
    born = over_frequency(np.linspace(1.048, 1.06, 5)).tips
    assert [(t.kind, t.fold) for t in born] == [("born", True)]
    down = over_frequency([1.2, 1.18])
    assert [(t.kind, t.fold) for t in down.tips] == [("born", True)]
    assert down.tips[0].value == pytest.approx(tip.value, abs=1e-10)


def test_what_nothing_forces_over_its_damping():
    found = basin_shares(well(), "c", [0.3, 0.6], box={"x": (-1.5, 1.5), "v": (-1.0, 1.0)}, starts=60, execution=ALONE)
    assert found.words == (("equilibrium", "equilibrium"),) * 2 and not found.tips
    assert (found.low[:, 0] < 0.5).all() and (found.high[:, 0] > 0.5).all()


def test_a_store_goes_on_where_it_ended(tmp_path):
    values, store = [1.16, 1.18, 1.2, 1.22], tmp_path / "s.zarr"

    class Ended(Exception):
        pass

    def stop(fraction: float) -> None:
        if fraction > 0.6:
            raise Ended

    with pytest.raises(Ended):
        over_frequency(values, execution=Execution(workers=1, store=store), progress=stop)
    resumed = over_frequency(values, execution=Execution(workers=2, store=store, resume=True))
    assert not stored_runs(store), "what was found is kept, not a family of runs for each value"
    plain = over_frequency(values)
    assert (resumed.counts == plain.counts).all()
    assert (resumed.words, resumed.tips) == (plain.words, plain.tips)


def test_what_is_asked_for_is_checked():
    for others, message in (
        ({"box": {}}, "Say where starts of cubic are drawn from"),
        ({"box": {"y": (0.0, 1.0)}}, "no state 'y'"),
        ({"box": {"x": (1.0, 0.0)}}, "'x' must be two ascending numbers"),
    ):
        with pytest.raises(StickslipError, match=message):
            over([1.5], **others)
    with pytest.raises(StickslipError, match="must be a list of finite numbers"):
        over([math.nan])
