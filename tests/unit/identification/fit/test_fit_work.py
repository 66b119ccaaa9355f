"""How a fit is worked at: by threads, in stages, until an interrupt."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import savgol_filter
from short_bench import bench
from threadpoolctl import threadpool_info

from fmu_models.base.errors import StickslipError
from fmu_models.base.threads import in_threads, one_blas_thread
from identification.estimators.base import Options
from identification.estimators.shooting import shoot
from identification.estimators.shooting_segments import ShootingProblem
from identification.fit.fit import fit_friction
from identification.inference.choice import Inference
from identification.laws import find_law
from identification.measurement.motion import savitzky_golay
from identification.measurement.pooled import Pool

CONTI = find_law("Conti")
NAMED = ("wear",)


@pytest.fixture(scope="module")
def ready() -> Pool:
    return bench(None)


@pytest.mark.nightly
def test_a_fit_is_the_same_to_the_last_bit_however_many_threads_share_it(ready: Pool) -> None:
    alone, shared = (
        fit_friction(ready, disturbances=NAMED, options=Options(workers=workers)).to_json() for workers in (1, 5)
    )
    assert alone == shared


def test_where_the_model_cannot_be_run_the_search_goes_on_from_where_it_was(ready: Pool) -> None:
    problem, found = shoot(ready, CONTI, np.array([0.65, 0.35, 15.0]), Options())
    assert isinstance(problem, ShootingProblem)
    last = problem.segments[-1]
    lost = replace(last, measured=np.full_like(last.measured, np.nan))
    broken = replace(problem, segments=(*problem.segments[:-1], lost), workers=1)
    before = [start.states.copy() for start in broken.starts]
    with pytest.raises(StickslipError, match="theta"):
        broken.evaluate(1.001 * found.values)
    np.testing.assert_array_equal([start.states for start in broken.starts], before)
    # what was evaluated is kept, and is what an evaluation from anew gives
    again = problem.resampled(np.arange(len(problem.segments))).evaluate(found.values)
    np.testing.assert_allclose(problem.evaluate(found.values).residual, again.residual, atol=1e-6)


def test_threads_keep_the_order_and_say_the_first_error() -> None:
    def half(value: int) -> int:
        if value in (3, 5):
            raise ValueError(str(value))
        return value // 2

    assert in_threads(half, [8, 2, 6], 2) == [4, 1, 3]
    with pytest.raises(ValueError, match="3"):
        in_threads(half, [8, 3, 2, 5], 4)


def test_matrices_stay_in_the_thread_that_asks() -> None:
    with one_blas_thread():
        assert {library["num_threads"] for library in threadpool_info()} == {1}


@pytest.mark.parametrize("asked", [Inference(), Inference(profile=True)])
def test_progress_rises_through_all_stages(ready: Pool, asked: Inference) -> None:
    told = [0.0]
    fit_friction(ready, estimator="weak-form", disturbances=NAMED, inference=asked, progress=told.append)
    steps = np.diff(told)
    assert (steps >= 0).all() and 0.5 < told[-1] <= 1 and steps.max() < 0.35 and len(set(told)) > 8


def interrupted(share: float) -> Callable[[float], None]:
    """Ctrl-C once that share of the work is done."""

    def told(done: float) -> None:
        if done >= share:
            raise KeyboardInterrupt

    return told


@pytest.mark.nightly_for("0.4-disturbances were not sought")
@pytest.mark.parametrize(
    "share, missing", [(0.4, "disturbances were not sought"), (0.56, r"show \(wear\) were not estimated")]
)
def test_an_interrupt_on_the_way_to_disturbances_keeps_the_plain_fit(ready: Pool, share: float, missing: str) -> None:
    given: dict[str, Any] = {"estimator": "weak-form", "law_spread": "none"}
    kept = fit_friction(ready, disturbances=NAMED, progress=interrupted(share), **given)
    plain = fit_friction(ready, disturbances="none", **given)
    assert kept.interrupted and not plain.interrupted
    assert kept.parameters == plain.parameters and not kept.causes
    assert re.search(f"^Interrupted: .*{missing}", kept.warnings[0])


@pytest.mark.parametrize("order, derivative", [(2, 0), (2, 1), (5, 2), (4, 5)])
def test_local_polynomials_are_those_of_scipy(order: int, derivative: int) -> None:
    values = np.random.default_rng(3).normal(size=90)
    expected = np.asarray(savgol_filter(values, 21, order, deriv=derivative, delta=0.01))
    found = savitzky_golay(values, 0.01, 0.21, order, derivative)
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-10 * max(np.abs(expected).max(), 1e-300))
