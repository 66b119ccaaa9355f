"""Declared periodic signals: what is refused, and what folding and pickling make of them."""

from __future__ import annotations

import pickle

import pytest
from signalled import buck

from fmu_models import Automaton, Parameter, PeriodicSignal, State, Switch
from fmu_models.base.errors import StickslipError
from fmu_models.lowering.fold import fold
from fmu_models.lowering.lower import lower

T = Parameter("T", 2.0, "s", "period", positive=True)


@pytest.mark.parametrize(
    ("options", "lesson"),
    [
        ({"knots": [(0, 1)]}, "must span one period"),
        ({"knots": [(0, 1), (0.5, 2)]}, "at the places 0, 0.5"),
        ({"knots": [(0, 1), (0.7, 2), (0.5, 2), (1, 0)]}, "must ascend from 0 to 1"),
        ({"knots": [(0, 1), (1, State("q", "1", "state"))]}, "made of q; it may use parameters only"),
        ({"knots": [(0, 1), (1, 2)], "period": 0.0}, "must be positive"),
    ],
)
def test_what_is_no_signal_is_refused(options, lesson):
    with pytest.raises(StickslipError, match=lesson):
        PeriodicSignal("s", "1", "signal", **{"period": T, **options})


def test_units_are_checked():
    x = State("x", "m", "place")
    slow = PeriodicSignal.sawtooth("s", "m", "signal", period=1 / T)
    with pytest.raises(StickslipError, match="the period of 's'"):
        Automaton(name="a", title="a", source="test", states=[x], flows={x: slow / T}, switches=[])


def test_it_names_its_parameters_and_is_no_input():
    declared = buck()
    assert {"f", "low", "high"} <= {p.name for p in declared.parameters}
    assert declared.inputs == () and [signal.name for signal in declared.signals] == ["ramp"]
    (ramp,) = declared.signals
    again = pickle.loads(pickle.dumps(ramp))
    assert again == ramp and again.knots == ramp.knots
    assert ramp.shape == "ramp = lines through (0, low), (1, high) over (t - 0)/(1/f) modulo 1"


def test_parameters_that_are_fixed_vanish_from_it():
    system = lower(buck())
    small = fold(system, fixed={"f": 2500.0, "low": 3.0}, values={}, start={}, outputs=())
    (ramp,) = small.signals
    assert "f" not in {p.name for p in small.parameters} and float(ramp.period) == 1 / 2500
    assert [str(value) for _, value in ramp.knots] == ["3", "high"]


def test_a_signal_shares_no_name():
    x = State("x", "1", "place")
    twice = PeriodicSignal.sawtooth("x", "1", "signal", period=T)
    side = Switch(name="side", function=x - twice)
    with pytest.raises(StickslipError, match="'x' names both"):
        Automaton(name="a", title="a", source="test", states=[x], flows={x: -x / T}, switches=[side])
