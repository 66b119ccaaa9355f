"""Closed loops away from the branch of a start: subharmonic motions on the support, which nothing leads to."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from forty_digits import follow
from scipy.optimize import fsolve
from test_exact_flow import support

from fmu_models import Strobe, load
from fmu_models.analyses.branch import Followed, follow_branch
from fmu_models.base.errors import StickslipError
from fmu_models.continuation.branches import Branches

# little damping in contact and a gap within reach: a motion of two periods with one contact
CONSTANTS = {"m": 1.0, "k": 1.0, "c": 0.05, "f0": 0.5, "ks": 10.0, "cs": 0.05, "g": 0.5}
OMEGA = 2.4


@pytest.fixture(scope="module")
def found() -> Branches:
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters={**CONSTANTS, "omega": 2.2})
    box = {"x": (-3.0, 3.0), "v": (-3.0, 3.0)}
    result = follow_branch(system, "omega", (2.0, 4.0), start={"x": 0, "v": 0}, settle=True, of="max(x)", box=box)
    assert isinstance(result, Followed) and isinstance(result.branch, Branches)
    return result.branch


def test_a_closed_loop_away_from_the_first_branch_is_found(found):
    first, loop = found.branches
    assert (first.every, loop.every) == (1, 2)
    assert [kind for kind, _ in first.ends] == ["range", "range"]
    assert [kind for kind, _ in loop.ends] == ["closed", "closed"]
    assert all(word == () for word in first.words) and all(word != () for word in loop.words)
    assert 0 < loop.stable.sum() < loop.count
    folds = [special.value for special in loop.special if special.kind == "fold"]
    assert (min(folds), max(folds)) == pytest.approx((loop.values.min(), loop.values.max()), abs=2e-3)


def test_its_motions_are_those_of_newtons_method_elsewhere(found):
    """Closed forms of both modes, to 40 digits, from a start that is not on it."""
    period = 2.0 * math.pi / OMEGA

    def miss(start: Any) -> Any:
        mode = "free" if start[0] < CONSTANTS["g"] else "on"
        return np.array(follow(support, {**CONSTANTS, "omega": OMEGA}, (mode, *start), period, 2)) - start

    for node in found.branches[1].at(OMEGA):
        x = node.state_at(0.0)
        solution, _, status, why = fsolve(miss, x + np.array([0.03, -0.05]), xtol=1e-13, full_output=True)
        assert status == 1 or np.abs(miss(solution)).max() < 1e-11, why
        assert solution == pytest.approx(x, abs=1e-10)


def test_a_box_is_of_what_is_forced(found):
    system = Strobe(load("planar_hopf"), period=4.8, autonomous=True)
    with pytest.raises(StickslipError, match="Starts in a box"):
        follow_branch(system, "mu", (0.9, 1.1), box={"x1": (-1.0, 1.0)})
    with pytest.raises(StickslipError, match="no state 'y'"):
        follow_branch(system, "mu", (0.9, 1.1), box={"y": (-1.0, 1.0)})
