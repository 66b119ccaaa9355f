"""Impacts of one to six contacts with friction at once, against the enumeration of all assignments."""

from __future__ import annotations

import numpy as np
import pytest
from impact_enumeration import Array, Impacts, collided, enumerated

from fmu_models.base.errors import StickslipError


def free(n: int, rng: np.random.Generator) -> Array:
    """As many directions as the contacts need, up to eight."""
    return rng.standard_normal((2 * n, min(8, 2 * n + 1)))


def tight(n: int, rng: np.random.Generator) -> Array:
    """Fewer directions than rates, so that contacts are redundant."""
    return rng.standard_normal((2 * n, n + 1))


def planar(n: int, rng: np.random.Generator) -> Array:
    """Contacts anywhere on one plane body of unit mass."""
    place, angle = rng.uniform(-1, 1, (n, 2)), rng.uniform(0, 2 * np.pi, n)
    J = np.empty((2 * n, 3))
    for rows, d in ((J[::2], (np.sin(angle), np.cos(angle))), (J[1::2], (np.cos(angle), -np.sin(angle)))):
        rows[:] = np.stack([*d, place[:, 0] * d[1] - place[:, 1] * d[0]], axis=1)
    return J / [1, 1, np.sqrt(rng.uniform(0.05, 1))]


def drawn(kind, n: int, mu: float, rng: np.random.Generator) -> Impacts:
    J = kind(n, rng)
    v = rng.standard_normal(J.shape[1])
    v = -v if (J[::2] @ v >= 0).all() else v
    e = np.full(n, rng.uniform()) if rng.random() < 0.5 else rng.uniform(0, 1, n)
    e = 0.0 * e if rng.random() < 0.3 else e
    return Impacts(J, v, rng.uniform(0.1, 1, n) * mu, e)


@pytest.mark.nightly_for("newton-free-0.5")
@pytest.mark.parametrize("mu", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("kind", [free, tight, planar])
@pytest.mark.parametrize("law", ["newton", "poisson"])
def test_velocities_are_those_of_the_enumeration(law: str, kind, mu: float) -> None:
    """The solution that loses most; where there is none, by inconsistent restitutions, the engine refuses too.

    From three redundant contacts on, Poisson's rule depends on how they share the impulse of compression, which the
    mechanics of rigid bodies leaves open: there, with equal restitutions, only gaps and energy are asked for.
    """
    rng = np.random.default_rng(5)
    for n, repetitions in ((1, 30), (2, 40), (3, 20), (4, 3), (5, 1), (6, 1)):
        for _ in range(repetitions):
            problem = drawn(kind, n, mu, rng)
            if law == "poisson" and n > (2 if kind is not free else 4):
                if kind is not free:
                    after = collided(law, problem._replace(e=np.full(n, problem.e[0])))
                    assert after @ after <= problem.v @ problem.v * (1 + 1e-12)
                    assert (problem.J[::2] @ after).min() >= -1e-9 * np.abs(problem.v).max()
                continue
            expected = enumerated(law, problem)
            if not expected:
                with pytest.raises(StickslipError, match=r"no impulses of .* obey the laws of impact"):
                    collided(law, problem)
                continue
            assert np.abs(collided(law, problem) - expected[0]).max() <= 1e-10 * np.abs(problem.v).max()


@pytest.mark.parametrize("law", ["newton", "poisson"])
@pytest.mark.parametrize("e", [0.0, 1e-14, 1e-9])
def test_restitution_that_is_as_small_as_rounding(law: str, e: float) -> None:
    """The expansion has impulses no larger than the rounding of those of the compression."""
    rng = np.random.default_rng(6)
    for kind in (free, tight, planar):
        for n in (1, 2, 3):
            problem = drawn(kind, n, 0.5, rng)
            plastic = enumerated("newton", problem._replace(e=np.zeros(n)))[0]
            after = collided(law, problem._replace(e=np.full(n, e)))
            assert np.abs(after - plastic).max() <= (1e-12 + 100 * e) * np.abs(problem.v).max()
