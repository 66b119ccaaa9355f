"""Weak form: the equation of motion averaged over windows inside slip segments, free of accelerations.

    J th'' + c th' + k th = R N mu(|v|) sgn(v)    times a bump phi that vanishes with its derivatives at both ends:
    integral (J phi'' - c phi' + k phi) th dt  =  R N integral phi mu(|v|) sgn(v) dt,      phi = (1 - s^2)^4, |s| < 1

The left side is linear in the raw angle, so that the covariance of its noise is known: windows that overlap are
whitened by it (generalised least squares). Only the slip speed v = r w - R th' inside mu is smoothed.
Windows of 0.264 natural periods (240 ms on the disc rig), every 20 ms or so. The idea is that of weak SINDy:
Messenger & Bortz (2021), Multiscale Model. Simul. 19, 1474; whitening as in their WENDy (2023), Bull. Math. Biol. 85,
110.
"""

from collections.abc import Sequence
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from identification.disturbances.term import Whereabouts
from identification.estimators import two_discs
from identification.estimators.base import Estimate, Estimator, Options
from identification.estimators.regression import (
    Regression,
    RegressionProblem,
    check_directions,
    reduced,
    regress,
    whereabouts,
)
from identification.estimators.savitzky_golay import STRUCTURE
from identification.estimators.windows import SPEED_ORDER, SPEED_WINDOW, WINDOW, bump, stride_of, whitening, windows
from identification.laws import FittableLaw
from identification.laws.joint_law import JointLaw
from identification.measurement.motion import odd_count, savitzky_golay
from identification.measurement.pooled import Pool, RigValues
from identification.measurement.slip_segments import SlipSegment

THIN = 6  # samples of a window between nodes of the averages of what is searched often
_kept: WeakKeyDictionary[Pool, RegressionProblem] = WeakKeyDictionary()


def estimate(ready: Pool, law: FittableLaw, options: Options) -> Estimate:
    """Friction law from pooled logs; of two discs by `identification.estimators.two_discs`. StickslipError: no slip
    segment holds a window, or friction has the wrong sign."""
    if isinstance(law, JointLaw):
        return Estimate(ESTIMATOR, law, *two_discs.estimate(ready, law, options))
    return Estimate(ESTIMATOR, law, *regress(ready, law, _equations, WINDOW, options))


def of_few_nodes(ready: Pool, law: FittableLaw, options: Options) -> RegressionProblem:
    """The problem with averages over few nodes, for what is searched often: among laws and among disturbances. Its
    equations are kept with the pool. Errors as for `estimate`.
    """
    if ready not in _kept:
        problem = reduced(ready, law, _equations, WINDOW, options)
        _kept[ready] = replace(problem, regression=problem.regression.thinned(THIN), rebuild=None)
    problem = replace(_kept[ready], law=law, terms=options.disturbances)
    check_directions(law, problem.regression.sign)
    return problem


def _equations(segments: Sequence[SlipSegment], logs: Sequence[int], rig: RigValues, period: float) -> Regression:
    step = segments[0].motion.step
    count = odd_count(WINDOW * period, step)
    average, weights = bump(count, step, rig)
    slips, measured, clusters, whiten, places = [], [], [], [], []
    white: dict[tuple[int, int, float], np.ndarray] = {}  # slips of one length share it
    for number, (segment, where) in enumerate(zip(segments, whereabouts(segments, logs, rig.N), strict=True)):
        speed = savitzky_golay(segment.angle, step, SPEED_WINDOW * period, SPEED_ORDER, 1)
        slip = segment.sign * (rig.r * segment.drive - rig.R * speed)
        spare = len(slip) - count
        stride = stride_of(spare, step, period)
        rows, angles = (windows(values, count, stride) for values in (slip, segment.angle))
        slips.append(np.abs(rows))
        measured.append(segment.sign * (angles @ weights))
        clusters.append(np.full(len(rows), number))
        overlap = stride, len(rows), segment.motion.memory / step
        if overlap not in white:
            white[overlap] = whitening(weights, *overlap)
        whiten.append(white[overlap])
        begins = np.arange(len(rows)) * stride
        middle = begins[:, None] + count // 2
        turned, load, speeds = (windows(values, count, stride).copy() for values in (where.turned, where.load, speed))
        at = where.map(lambda values, middle=middle: values[middle])  # what changes slowly: time, temperature
        places.append(replace(at, turned=turned, angle=angles, load=load, speed=speeds))
    cluster = np.concatenate(clusters)
    log = np.asarray(logs)[cluster]
    return Regression(
        np.concatenate(slips),
        average,
        np.concatenate(measured),
        cluster,
        log,
        tuple(whiten),
        where=Whereabouts.joined(places),
        noise=float(np.linalg.norm(weights)),
        sign=np.array([float(segment.sign) for segment in segments])[cluster],
        spring=rig.spring,
    )


ESTIMATOR = Estimator("weak-form", STRUCTURE, estimate, inverse=True)
