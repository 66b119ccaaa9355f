"""States and drifting parameters sample by sample, by an unscented filter over runs from one sample to the next.

    z = (states, parameters that walk),    P = S S',    S := triangle of [S, diag(rates) sqrt(dt)]
    z_i = z +- sqrt(n) S_i,    a run of each to the sample, where it shows z_i' and y_i
    triangle of [ y_i - y   noise ]  =  [ L       ]
                [ z_i' - z'   0   ]     [ G    S' ]        z' + G L^-1 (measured - y)

Weights of all 2 n points are equal, so that no variance can become negative; where motion and measurement are linear,
this is Kalman's filter. A motion that cannot begin anew at a sample, in a stop or at a wall, goes on from the last one
where it could, and measurements correct what it was there. Points that have no run are taken nearer to their middle.

Sources: Julier, Uhlmann (2004), Proc. IEEE 92, 401; Arasaratnam, Haykin (2009), IEEE Trans. Automatic Control 54, 1254
(equal weights, triangles).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown
from fmu_models.base.threads import one_blas_thread
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.signal import Signal
from identification.calibration.drifting import CHANCE
from identification.calibration.log import LogLike, measurable
from identification.calibration.pose import Settings
from identification.calibration.segments import IDEAL, Sensor
from identification.calibration.subject import Inputs, Stretch, Vector, Window
from identification.calibration.systems import opened, subject_of
from identification.calibration.track import FIRST, Course, course_of, posed

if TYPE_CHECKING:
    from fmu_models.codegen.package import Model
    from fmu_models.coupling.system import CoupledSystem
    from fmu_models.language.maps import Map
    from identification.calibration.descent import Progress

NEARER = (1.0, 0.3, 0.1, 0.01)  # of a point's distance from the middle, until it has a run


@dataclass(frozen=True)
class Estimate(Shown):
    """What is known at a time (s) by all samples until then: of states, parameters and what else is shown; innovations:
    of what was measured, over their deviations."""

    time: float
    values: Mapping[str, float]
    deviations: Mapping[str, float]
    innovations: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class _Correction:
    """white: (k,) innovations over their deviations; middle, root: (n,), (n, n) of what is estimated; shown,
    deviations: (m,) of what is told."""

    white: Vector
    log_likelihood: float
    middle: Vector
    root: Vector
    shown: Vector
    deviations: Vector


class OnlineTrack:
    """A filter that is given sample after sample.

    Args:
        model: as in `track`.
        noise: standard deviation by measured state or output.
        rates: of walks of parameters and states, in their unit per root of a second; 0 of a parameter that is sought
            and stays.
        parameters: values held, first values of those that walk, start states.
        deviations: of start states and first values; as large as these if they are not said.
        shown: other outputs that are wanted.

    Raises:
        StickslipError: a name that is none, a noise that is not positive, an FMU that is co-simulated.
    """

    def __init__(
        self,
        model: Model | Fmu | CoupledSystem | Map,
        noise: Mapping[str, float],
        *,
        rates: Mapping[str, float] | None = None,
        parameters: Mapping[str, float] | None = None,
        deviations: Mapping[str, float] | None = None,
        shown: Sequence[str] = (),
    ) -> None:
        fmu, rates, first, given = opened(model), rates or {}, parameters or {}, deviations or {}
        walking = [name for name in rates if name not in fmu.states]
        for name in (*walking, *first):
            known = (*fmu.parameters, *fmu.memories, *fmu.states)
            refuse_unknown(name, known, f"'{fmu.description.modelName}' has no parameter '{name}'.")
        for name in (*noise, *shown):
            refuse_unknown(name, measurable(fmu), f"There is no state or output '{name}' to be seen.")
        if not noise or not all(sd > 0 for sd in noise.values()):
            raise StickslipError("A filter needs the noise of what is measured, above 0: noise={'x': 0.01}.")
        self.subject = subject_of(fmu, walking, [*noise, *shown])
        if not self.subject.states:
            raise StickslipError(f"'{fmu.description.modelName}' is co-simulated and does not show its states.")
        self.names = (*self.subject.states, *walking)
        self.noise, self.time, self.log_likelihood = dict(noise), -np.inf, 0.0
        values = [first.get(name, fmu.start_of(name)) for name in self.names]
        self._middle = np.array(values)
        sizes = [abs(value) or fmu.size_of(name) for name, value in zip(self.names, values, strict=True)]
        self._root = np.diag([given.get(name, size) for name, size in zip(self.names, sizes, strict=True)])
        self._rates = np.array([rates.get(name, 0.0) for name in self.names])
        variables = (fmu.variables[name] for name in self.names)
        bounds = [(v.min, v.max) if v.causality == "parameter" else (None, None) for v in variables]
        self._low = np.array([-np.inf if low is None else float(low) for low, _ in bounds])
        self._high = np.array([np.inf if high is None else float(high) for _, high in bounds])
        self._held = {name: value for name, value in first.items() if name not in self.names}
        self._begin, self._inputs = -np.inf, {}

    def update(self, time: float, measured: Mapping[str, float], inputs: Inputs | None = None) -> Estimate:
        """The next sample. time: s, after the last one; measured: values by name, of all or some of what may be, NaN of
        what is not; inputs: since the last sample, constants or `Signal`. Of the first sample only states are used.

        Raises:
            StickslipError: times that do not ascend, a name that is none, a motion that cannot go on.
        """
        if not time > self.time:
            raise StickslipError(f"Samples come one after the other; found {time:g} s after {self.time:g} s.")
        for name in measured:
            refuse_unknown(name, self.noise, f"The filter was given no noise of '{name}'.")
        begins, recorded = self.time == -np.inf, self.subject.recorded
        elapsed = 0.0 if begins else time - self.time
        root = _triangle(np.hstack([self._root, np.diag(self._rates * np.sqrt(elapsed))]).T)
        steps = np.sqrt(len(root)) * root.T
        points = self._middle + np.vstack([steps, -steps])
        if begins:
            count = len(self.subject.states)
            seen = np.hstack([points[:, :count], np.full((len(points), len(recorded) - count), np.nan)])
            self._begin = time
        else:
            driven = {name: self._since(name, form, time) for name, form in (inputs or {}).items()}
            window, self._inputs = Window(self._begin, np.array([time]), driven), driven
            pairs = [self._pair(window, step) for step in steps]
            seen = np.array([above for above, _ in pairs] + [below for _, below in pairs])
        reached = np.hstack([seen[:, : len(self.subject.states)], points[:, len(self.subject.states) :]])
        values = {name: value for name, value in measured.items() if np.isfinite(value)}
        values = {name: value for name, value in values.items() if np.isfinite(seen[0, recorded.index(name)])}
        shown = np.hstack([reached, seen])
        correction = self._corrected(values, seen, reached, shown)
        if begins or self._open(time, correction.middle):
            self._begin, self._middle, self._root = time, correction.middle, correction.root
        else:
            back = self._corrected(values, seen, points, shown)
            # where not even what it was then may be corrected, the sample counts for what is told now alone
            kept = self._open(self._begin, back.middle)
            self._middle, self._root = (back.middle, back.root) if kept else (self._middle, root)
        self.time = time
        self.log_likelihood += correction.log_likelihood
        told = (correction.shown, correction.deviations, correction.white)
        names = ((*self.names, *recorded), (*self.names, *recorded), values)
        return Estimate(time, *(dict(zip(of, row.tolist(), strict=True)) for of, row in zip(names, told, strict=True)))

    def _open(self, time: float, point: Vector) -> bool:
        """Whether the motion can begin anew at a time and a point (n,)."""
        return not self.subject.closed(self._stretch(Window(time, np.array([time]), self._inputs), point))

    def _since(self, name: str, form: float | Signal, time: float) -> Signal:
        """An input from where runs begin."""
        piece = form if isinstance(form, Signal) else Signal.constant(form, self.time, time)
        if piece.time[0] <= self._begin or name not in self._inputs:
            return piece
        earlier = self._inputs[name]
        return Signal(np.append(earlier.time, piece.time), np.append(earlier.value, piece.value))

    def _stretch(self, window: Window, point: Vector) -> Stretch:
        values = dict(zip(self.names, np.clip(point, self._low, self._high).tolist(), strict=True))
        start = {name: values.pop(name) for name in self.subject.states}
        return Stretch(window, {**self._held, **values}, start)

    def _reached(self, window: Window, offset: Vector) -> Vector | None:
        """(k,) of what is recorded at the end of a run from beside the middle, None if there is none."""
        try:
            return self.subject.shown(self._stretch(window, self._middle + offset)).values[-1]
        except StickslipError:
            return None

    def _pair(self, window: Window, step: Vector) -> tuple[Vector, Vector]:
        """The same of a point and of its mirror image."""
        above = below = None
        for share in NEARER:
            above, below = self._reached(window, share * step), self._reached(window, -share * step)
            if above is not None and below is not None:
                away = (above - below) / 2
                return (above + below) / 2 + away / share, (above + below) / 2 - away / share
        middle = self._reached(window, 0 * step)
        if middle is None:
            raise StickslipError(
                f"From {window.start_time:g} s no run reaches {window.times[-1]:g} s near what was estimated. "
                "Give other start states or smaller deviations of them."
            )
        one_sided = (above, middle) if above is not None else (middle, below if below is not None else middle)
        away = (one_sided[0] - one_sided[1]) / NEARER[-1]
        return middle + away, middle - away

    def _corrected(self, values: Mapping[str, float], seen: Vector, points: Vector, shown: Vector) -> _Correction:
        """Points (2 n, n), and what is shown (2 n, m), by the measured ones among the variables that are seen."""
        columns = [self.subject.recorded.index(name) for name in values]
        rows, (n, k) = np.hstack([seen[:, columns], points, shown]), (points.shape[1], len(values))
        middle = rows.mean(axis=0)
        noises = np.zeros((k, rows.shape[1]))
        noises[:, :k] = np.diag([self.noise[name] for name in values])
        root = _triangle(np.vstack([(rows - middle) / np.sqrt(len(rows)), noises]))
        triangle, signs = root[:k, :k], np.where(np.diag(root)[:k] < 0, -1.0, 1.0)
        white = np.linalg.solve(triangle, np.array([*values.values()]) - middle[:k])
        likelihood = -(white @ white + k * np.log(2 * np.pi)) / 2 - np.sum(np.log(np.abs(np.diag(triangle))))
        middle = middle[k:] + root[k:, :k] @ white
        lengths = np.linalg.norm(root[k + n :, k:], axis=1)
        return _Correction(white * signs, likelihood, middle[:n], root[k : k + n, k : k + n], middle[n:], lengths)


def _triangle(rows: Vector) -> Vector:
    """(m, <= m) lower triangle T of rows (n, m), with T T' = rows' rows."""
    return np.asarray(np.linalg.qr(rows, mode="r")).T


@one_blas_thread()
def track_online(
    model: Model | Fmu | CoupledSystem | Map,
    log: LogLike,
    *,
    drift: Sequence[str] = (),
    rates: Mapping[str, float] | None = None,
    states: Sequence[str] | None = None,
    settings: Settings | None = None,
    progress: Progress | None = None,
    **more: object,
) -> Course:
    """Follow a log as it would have been while it was made: each estimate knows the samples until then alone.

    Args:
        rates: of walks of parameters and states, in their unit per root of a second; of what drifts a fifth of itself
            over the log if it is not said.
        model, log, drift, states, settings, progress: as in `track`. Noise that is not stated is that of the log's
            neighbours.

    Raises:
        StickslipError: as in `track` and `OnlineTrack`.
    """
    free_run, said, wanted = posed(model, log, drift, states, settings, more)
    (read,), fmu = free_run.logs, free_run.subject.fmu
    if stray := [name for name in rates or {} if name not in (*drift, *fmu.states)]:
        raise StickslipError(f"'{stray[0]}' has a rate and does not drift. Add it to --drift.")
    first = {name: said.parameters.get(name, fmu.start_of(name)) for name in drift}
    span = float(np.ptp(read.time))
    walks = {**{name: FIRST * max(abs(first[name]), 1e-9) / span**0.5 for name in drift}, **(rates or {})}
    noise = {name: free_run.noise[0, name] for name in read.measured}
    measured = {name: _undone(free_run.sensors.get(name, IDEAL), values) for name, values in read.measured.items()}
    noise = {name: sd / abs(free_run.sensors.get(name, IDEAL).gain) for name, sd in noise.items()}

    def followed(walks: Mapping[str, float]) -> tuple[list[Estimate], float]:
        run = OnlineTrack(fmu, noise, rates=walks, parameters=said.parameters, shown=wanted)
        rows = zip(*measured.values(), strict=True)
        named = (dict(zip(measured, row, strict=True)) for row in rows)
        return [
            run.update(*sample, read.inputs) for sample in zip(read.time.tolist(), named, strict=True)
        ], run.log_likelihood

    estimates, likelihood = followed(walks)

    def course(name: str) -> tuple[Vector, Vector]:
        pairs = np.array([(one.values[name], one.deviations[name]) for one in estimates])
        return pairs[:, 0], pairs[:, 1]

    drifts = {}
    for number, name in enumerate(drift):
        (progress or (lambda _: None))((number + 1) / (len(drift) + 1))
        gain = 2 * (likelihood - followed({**walks, name: 0.0})[1])
        drifts[name] = (*course(name), walks[name] if gain > CHANCE else 0.0, gain)
    rows = [np.array([one.innovations.get(name, np.nan) for one in estimates]) for _, name in free_run.series]
    rows = [row[np.isfinite(row)] for row in rows]
    return course_of(free_run, {name: course(name) for name in wanted}, drifts, read.time.tolist(), rows, online=True)


def _undone(sensor: Sensor, values: Vector) -> Vector:
    """What a sensor saw, NaN at its limits. StickslipError: it is late."""
    if sensor.delay:
        raise StickslipError("A filter takes samples as they come: no delay of a sensor. Shift the log's times.")
    inside = (values > sensor.clip[0]) & (values < sensor.clip[1])
    return np.where(inside, (values - sensor.offset) / sensor.gain, np.nan)
