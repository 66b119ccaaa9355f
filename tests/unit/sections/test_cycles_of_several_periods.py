"""Motions of several periods are corrected by one call as each group is by itself."""

import numpy as np
import pytest

from fmu_models.maps.logistic import MAP
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.periodic import corrected_cycles


def test_groups_are_corrected_as_each_alone_and_lost_cycles_stay_their_own():
    """x -> r x (1 - x): the fixed point 1 - 1/r, and the cycle (r + 1 -+ sqrt((r - 3)(r + 1)))/(2r)."""
    r = np.array([3.2, 3.3, 3.4])
    apart = np.sqrt((r - 3.0) * (r + 1.0))
    pairs = np.stack([r + 1.0 - apart, r + 1.0 + apart], axis=1)[..., None] / (2.0 * r[:, None, None])
    fixed = (1.0 - 1.0 / r)[:, None, None]
    guesses = [fixed + 1e-8, pairs + 1e-8]
    guesses[1][1, 1] = 1e200  # from there a step does not arrive
    system, varied = Iteration.of(MAP), [{"r": r}, {"r": r}]
    together = corrected_cycles(system, guesses, varied)
    for (cycles, numbers), group, at, exact in zip(together, guesses, varied, (fixed, pairs), strict=True):
        ((alone, same),) = corrected_cycles(system, [group], [at])
        assert numbers.tolist() == same.tolist()
        assert np.array_equal(cycles.points, alone.points) and np.array_equal(cycles.eigenvalues, alone.eigenvalues)
        assert cycles.points == pytest.approx(exact[numbers], abs=1e-14)
    assert [numbers.tolist() for _, numbers in together] == [[0, 1, 2], [0, 2]]
