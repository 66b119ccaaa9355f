"""The laser shows sin(theta) + o_i + d_i1 u + d_i2 (u^2 - 1/12) + sum_n d_in cos((n - 2) pi (u + 1/2)) over R,
n = 3 .. 6: cosines converge fast once a parabola has taken the slopes at both ends.

Where drives all turn one way, o_1 is only known to be of the size of the drift (half of the greatest), which it had in
a free decay too.
"""

from types import ModuleType

import numpy as np

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.laser_bend import taken_off
from identification.disturbances.term import LASER, DisturbanceTerm, Effect, Whereabouts
from identification.inference.problem import Prior
from identification.measurement.pooled import Pool

CURVES = 6  # of a drift in each log
FURTHEST = 0.1  # over R, of what a laser shows too much
DRIFTING, LEAST_DRIFT = 2e-4, 1e-5  # m, of a laser: assumed until it is found, and at least


def _curve(at: Whereabouts, order: int, functions: ModuleType) -> np.ndarray:
    if order < 3:
        return (np.ones_like(at.share), at.share, at.share**2 - 1 / 12)[order]
    return functions.cos((order - 2) * np.pi * (at.share + 0.5))


CURVE = Effect("drift", _curve, acts=LASER, limits=(-FURTHEST, FURTHEST), width=lambda order: 2e-3)


def _terms(ready: Pool, size: float | None) -> list[DisturbanceTerm]:
    deviation = 0.5 * max(DRIFTING if size is None else size, LEAST_DRIFT) / ready.values.R
    first = None if ready.slips_both_ways else Prior("drift0_1", 0.0, "1", deviation, "half of the drift")
    logs = range(len(ready.motions))
    offsets = [DisturbanceTerm(f"drift0_{i + 1}", CURVE, 0, i, prior=None if i else first) for i in logs]
    curves = [DisturbanceTerm(f"drift{n}_{i + 1}", CURVE, n, i) for i in logs for n in range(1, CURVES + 1)]
    return [*offsets, *curves]


def shifts(ready: Pool) -> list[DisturbanceTerm]:
    """What a drift that was taken off leaves open of the mean of each log."""
    shifted = {i: motion.shift for i, motion in enumerate(ready.motions) if motion.shift}
    priors = {i: Prior(f"drift0_{i + 1}", 0.0, "1", shift, "drift taken off") for i, shift in shifted.items()}
    words = "mean of a drift of the laser, over R"
    return [DisturbanceTerm(prior.name, CURVE, 0, i, 0.0, prior, words, cause="drift") for i, prior in priors.items()]


def _hidden(ready: Pool) -> str:
    if any(motion.log.has("angle") or not motion.log.has("laser") for motion in ready.motions):
        return "not all have their angle from a laser."
    return taken_off(ready)


DISTURBANCE = Disturbance(
    words="the laser drifts, and no encoder shows how: told by friction alone it is known poorly",
    terms=_terms,
    hidden=_hidden,
    told_by="an encoder beside the laser",
    rank=5,
    mimics="wear",
    emulated=("drift", "offset"),
)
