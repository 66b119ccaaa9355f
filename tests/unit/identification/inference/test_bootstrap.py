"""Block bootstrap: closed forms of means, seeds, processes, interrupts."""

from __future__ import annotations

import numpy as np
import pytest
from linear_problem import Curve, linear

from fmu_models.base.errors import StickslipError
from identification.inference.bootstrap import bootstrap
from identification.inference.problem import Prior, Unknown, solve


def means(seed: int = 0, clusters: int = 24) -> tuple[Curve, float]:
    """A mean over two logs with clusters of five values that share an offset; the variance of the mean by its parts."""
    rng = np.random.default_rng(seed)
    offset = rng.standard_normal(clusters)
    cluster = np.repeat(np.arange(clusters), 5)
    log = (cluster >= clusters // 2).astype(int)
    measured = offset[cluster] + 3.0 * log + 0.1 * rng.standard_normal(len(cluster))
    of_cluster = measured.reshape(clusters, 5).mean(axis=1)
    half = clusters // 2
    # strata: the difference between the logs does not count
    variance = (np.var(of_cluster[:half], ddof=1) + np.var(of_cluster[half:], ddof=1)) / half / 4
    return linear(np.ones((len(cluster), 1)), measured, cluster=cluster, log=log), float(variance)


def test_covariance_of_a_mean_is_that_of_cluster_means_within_logs() -> None:
    problem, variance = means()
    draws = bootstrap(problem, solve(problem), draws=600, seed=1)
    # 600 draws know a variance to 6 %
    assert draws.covariance[0, 0] == pytest.approx(variance, rel=0.2)
    interval = draws.interval(0, "a", 0.95)
    assert interval.high is not None and interval.low is not None
    assert interval.high - interval.low == pytest.approx(2 * 1.96 * np.sqrt(variance), rel=0.2)
    assert interval.kind == "bootstrap" and draws.warnings == ()


def test_a_seed_gives_the_same_draws_in_one_process_or_two() -> None:
    problem, _ = means()
    found = solve(problem)
    here = bootstrap(problem, found, draws=24, seed=7, processes=1).values
    shared = bootstrap(problem, found, draws=24, seed=7, processes=2).values
    np.testing.assert_allclose(np.sort(shared, axis=0), np.sort(here, axis=0), rtol=1e-12)
    assert not np.array_equal(here, bootstrap(problem, found, draws=24, seed=8, processes=1).values)


def test_what_is_known_beforehand_is_drawn_too() -> None:
    # the second unknown is known by its prior alone; the first takes its error over
    prior = Prior("b", 1.0, "1", 0.5, "test")
    cluster = np.repeat(np.arange(30), 3)
    unknowns = (Unknown("a", "1"), Unknown("b", "1", prior=prior))
    measured = 1e-3 * np.random.default_rng(0).standard_normal(90)
    problem = linear(np.ones((90, 2)), measured, cluster=cluster, unknowns=unknowns)
    draws = bootstrap(problem, solve(problem), draws=300, seed=2)
    assert np.sqrt(draws.covariance[1, 1] / draws.blocks) == pytest.approx(0.5, rel=0.15)
    assert np.corrcoef(draws.values.T)[0, 1] == pytest.approx(-1, abs=1e-3)


def test_an_interrupt_keeps_what_is_finished() -> None:
    problem, _ = means()
    seen = []

    def stop(done: float) -> None:
        seen.append(done)
        if len(seen) == 30:
            raise KeyboardInterrupt

    draws = bootstrap(problem, solve(problem), draws=100, seed=1, progress=stop)
    assert draws.interrupted and len(draws.values) == 30
    assert "30 of 100 draws count" in draws.warnings[0]
    np.testing.assert_array_equal(draws.values, bootstrap(problem, solve(problem), draws=30, seed=1).values)

    def at_once(done: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bootstrap(problem, solve(problem), draws=100, seed=1, progress=at_once)


def test_too_little_is_refused() -> None:
    problem, _ = means()
    with pytest.raises(StickslipError, match="take 200"):
        bootstrap(problem, solve(problem), draws=5)
    few, _ = means(clusters=4)
    with pytest.raises(StickslipError, match="five or more"):
        bootstrap(few, solve(few), draws=50)
