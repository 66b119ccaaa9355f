"""Logs of loops and decays as their models take them, those of a fit and others that are held against its result."""

import os
from collections.abc import Sequence

import numpy as np

from fmu_models.simulation.signal import Signal
from identification.calibration.log import ModelLog
from identification.calibration.result import Calibration
from identification.hysteresis.decay import DECAY, read_decays, thinned
from identification.hysteresis.laws import FORCE, HELD, LOAD, WAY
from identification.hysteresis.loop import LoopLog
from identification.hysteresis.read import read_loop

MOST = 2000  # samples of a log that laws are compared with
STILL = 1e-9  # of the range: what a way that stands goes on a sample, so that times ascend
LOOP, TIMED_LOOP = "loop", "loop over time"  # what columns are for, beside decays


def loop_log(log: LoopLog, rate: bool, states: Sequence[str]) -> ModelLog:
    """The log of a model of loops with ``states`` of its law, whose start nobody knows where it is not at rest.

    The way is followed between its reversals and `MOST` samples. Where nothing but it moves and nothing depends on the
    ``rate``, a second is what it goes between samples on average: it is straight from turn to turn, and a run holds few
    pieces. Else samples are a second apart where nobody says when they were, and a way that stands, which has no sense,
    is drawn from where it came to to where it goes on.
    """
    stride = max(len(log.way) // MOST, 1)
    begun = tuple(states) if log.turned or not log.known else ()
    knots = np.union1d(np.arange(0, len(log.way), stride), log.reversals)
    if log.load is not None or (rate and log.time is not None):
        moving = knots[np.concatenate([[True], np.diff(log.way[knots]) != 0])]
        time = np.arange(len(log.way), dtype=float) if log.time is None else log.time - log.time[0]
        time = time[: moving[-1] + 1]
        log = log.part(0, int(moving[-1]) + 1)
        inputs = {WAY: Signal(time[moving], log.way[moving])}
        if log.load is not None:
            inputs[LOAD] = Signal(time[moving], log.load[moving])
        return ModelLog(log.name, time, {FORCE: log.force}, inputs, over=WAY, begun=begun).every(stride)
    path = LoopLog(log.name, log.way[knots], log.force[knots])
    steps = np.abs(np.diff(path.way)) + STILL * path.range
    time = np.concatenate([[0.0], np.cumsum(steps / steps.mean())])
    inputs = {WAY: Signal(time[path.turns], path.way[path.turns])}
    return ModelLog(log.name, time, {FORCE: path.force}, inputs, over=WAY, begun=begun)


def read_again(
    calibration: Calibration, path: str | os.PathLike[str], reader: str | None = None
) -> tuple[ModelLog, ...]:
    """Logs of a file as those of a fit of loops or decays were read. reader: of the user, for a kind of file of his
    own. StickslipError: as in `read.read_loop` and `decay.read_decays`."""
    reading = calibration.reading
    options = {"columns": reading.columns, "units": reading.units, "reader": reader}
    if reading.roles == DECAY:
        return tuple(map(thinned, read_decays(path, **options)))
    log = read_loop(os.fspath(path), **options).smooth().from_largest()
    states = [name for name in calibration.held if name.startswith(f"{HELD}_")]
    return (loop_log(log, reading.roles == TIMED_LOOP, states),)
