"""The machine that a recipe's terms declare: its columns in closed form, and what its friction holds at rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identification.machines.axis import columns_of, declared_axis
from identification.machines.axis_terms import KINDS, Term, read_model
from identification.machines.machine_fit import identify_machine
from identification.machines.motion import MachineLog
from identification.measurement.recipe import Speed, read_recipe
from rig_io.readers import read_table

AXIS = Path(__file__).parents[2] / "data" / "machines" / "axis.csv"
TRUTH = {"M": 20.0, "Fv": 60.0, "Fc": 12.0, "offset": -1.5}  # data/README.md

OVER = 0.3  # rad/s
CLOSED = {
    "inertia": lambda q, v, a: a,
    "viscous": lambda q, v, a: v,
    "viscous+": lambda q, v, a: np.maximum(v, 0),
    "viscous-": lambda q, v, a: np.minimum(v, 0),
    "quadratic": lambda q, v, a: v * np.abs(v),
    "coulomb": lambda q, v, a: np.sign(v),
    "coulomb+": lambda q, v, a: np.maximum(np.sign(v), 0),
    "coulomb-": lambda q, v, a: np.minimum(np.sign(v), 0),
    "coulomb-arctan": lambda q, v, a: np.arctan(v / OVER),
    "coulomb-tanh": lambda q, v, a: np.tanh(v / OVER),
    "offset": lambda q, v, a: np.ones_like(v),
    "gravity": lambda q, v, a: 9.81 * np.sin(q),
    "stiffness": lambda q, v, a: q,
}


def term(kind: str) -> Term:
    return Term(f"p {kind}", kind, Speed(OVER) if KINDS[kind].smoothed else None)


# inertia last, and a machine without: what stands in the declaration first need not be the first column
@pytest.mark.parametrize("kinds", [[*KINDS][::-1], ["offset", "coulomb"]], ids=["all", "no inertia"])
def test_columns_of_the_declared_machine_are_those_of_the_terms(kinds):
    assert KINDS.keys() == CLOSED.keys()
    rng = np.random.default_rng(3)
    q, v, a = rng.normal(size=(3, 200))
    v[:5] = 0.0
    found = columns_of(tuple(map(term, kinds)), True)({"position": q, "velocity": v, "acceleration": a})
    for kind, column in zip(kinds, found.T, strict=True):
        assert column == pytest.approx(CLOSED[kind](q, v, a), rel=1e-14, abs=1e-15), kind


def test_a_signal_that_is_not_there_counts_as_zero():
    columns = columns_of((term("inertia"), term("viscous")), False)
    assert columns({"velocity": np.array([2.0])}) == pytest.approx(np.array([[0.0, 2.0]]))


def test_friction_at_rest_holds_what_the_terms_of_each_direction_say():
    """A push forwards is held by friction of positive slip."""
    axis = declared_axis(tuple(map(term, ("inertia", "coulomb", "coulomb+", "coulomb-", "viscous+"))), False)
    (contact,) = axis.frictions
    by_name = {p.name: p for p in axis.parameters}
    both, plus, minus = (by_name[name] for name in ("p_coulomb", "p_coulomb_plus", "p_coulomb_minus"))
    assert contact.law.capacity_minus == both + plus
    assert contact.law.capacity == both + minus


def test_the_machine_of_a_recipe_is_identified_by_instruments_as_any_other():
    columns = read_table(AXIS).columns
    log = MachineLog("axis", columns["time"], 1e-3 * columns["position"][:, None], columns["force"][:, None])
    axis = declared_axis(read_model(read_recipe("axis")).terms, turning=False)
    fit = identify_machine(axis, [log], cutoff=30.0)
    assert [one.name for one in fit.parameters] == [*TRUTH]
    for name, value in TRUTH.items():
        assert abs(fit[name].value - value) < 3 * fit[name].standard_deviation < 0.15 * abs(value)
    assert fit.verdicts == ()
