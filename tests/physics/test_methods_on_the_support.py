"""Errors of the methods on the oscillator with a support: ten periods of its known motion, soft and stiff.

The numbers were found with other programs (RKF45 and scipy's solvers on hand-written equations); a factor of three
covers what differs, the control of the steps. Where a step happens to land at a boundary decides an error as much as
the method does, and the last digit of a sum decides where it lands: known is the median of runs whose tolerances differ
by percents.
"""

import numpy as np
import pytest

from fmu_models.validation.bench.problems import problem
from fmu_models.validation.methods.catalogue import OURS
from fmu_models.validation.methods.smoothing import Smoothing
from fmu_models.validation.methods.switch_model import SwitchModel

SOFT, STIFF = "discontinuous_support_table_1", "discontinuous_support_table_1_stiff"


@pytest.fixture(scope="module", params=[SOFT, STIFF])
def case(request):
    return request.param, problem(request.param)


def end_error(method, problem, tolerance):
    return float(np.abs(method.prepare(problem)(tolerance).end - problem.start).max())


def test_event_driven_is_right_to_rounding(case):
    name, of = case
    assert end_error(OURS, of, 1e-14) < {SOFT: 4e-14, STIFF: 2e-13}[name]


def typical_error(method, problem, tolerance, runs):
    """The median of the errors at tolerances within 10 % of the one given."""
    run = method.prepare(problem)
    ends = [run(tolerance * factor).end for factor in np.linspace(0.9, 1.1, runs)]
    return float(np.median([np.abs(end - problem.start).max() for end in ends]))


# single runs of the first and the third method scatter by a factor of 3.3 on the soft support, which 21 runs narrow to
# one of 1.4; those of the others seldom leave their median, so that three are enough
@pytest.mark.nightly_for(
    "discontinuous_support_table_1-tanh 1e-05, RK45---", "discontinuous_support_table_1-switch model, eta 0.0001---"
)
@pytest.mark.parametrize(
    ("method", "tolerance", "known", "runs"),
    [
        (SwitchModel(1e-4), 1e-8, (1.0e-6, 1.7e-5), (21, 3)),
        (Smoothing("tanh", 1e-3, "DOP853"), 1e-10, (2.0e-6, 5.4e-5), (3, 3)),
        (Smoothing("tanh", 1e-5, "RK45"), 1e-10, (1.0e-8, 1.0e-6), (21, 3)),
        (Smoothing("arctan", 1e-3, "DOP853"), 1e-10, (4.4e-4, 5.4e-4), (3, 3)),
        (Smoothing("arctan", 1e-5, "DOP853"), 1e-10, (4.4e-6, 3.6e-6), (3, 3)),
    ],
    ids=lambda value: value.name if hasattr(value, "name") else "",
)
def test_error_is_the_known_one(case, method, tolerance, known, runs):
    name, of = case
    which = (SOFT, STIFF).index(name)
    assert known[which] / 3 < typical_error(method, of, tolerance, runs[which]) < 3 * known[which]


def test_floor_of_the_switch_model_grows_with_its_band(case):
    """As eta^2 on the soft support, whose force jumps little; about as eta on the stiff one."""
    name, of = case
    bands = (1e-2, 1e-3, 1e-4)
    known = {SOFT: (2.8e-4, 2.8e-6, 2.8e-8), STIFF: (5.7e-3, 7.2e-5, 1.6e-5)}[name]
    floors = [end_error(SwitchModel(eta), of, 1e-12) for eta in bands]
    assert floors == pytest.approx(known, rel=0.5)
    if name == SOFT:
        assert np.diff(np.log10(floors)) == pytest.approx([-2.0, -2.0], abs=0.02)


def test_frozen_mode_fails():
    """One mode per step: the soft support is wrong by percents, the stiff one throws the mass away."""
    frozen = SwitchModel(1e-4, frozen=True)
    assert 4.4e-2 / 3 < end_error(frozen, problem(SOFT), 1e-8) < 3 * 4.4e-2
    assert end_error(frozen, problem(STIFF), 1e-8) > 1e3
