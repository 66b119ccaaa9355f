"""What a scene computes, through its FMU, and how that compares with what is known of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.scene import Scene
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal
from fmu_models.simulation.trajectory import Trajectory

KEPT = 32  # periods at the end of a strobe, among which different points are counted
SAME = 1e-6  # of the size of a state, up to which two points of a strobe are one


@dataclass(frozen=True, eq=False)
class Row:
    """One thing computed: results by name, in the units of the model, and the run if there was one.

    at: value of the swept quantity, None if nothing is swept.
    """

    at: float | None
    values: Mapping[str, float]
    trajectory: Trajectory | None = None


@dataclass(frozen=True)
class Comparison:
    """A result against its known value; error relative to it, absolute where it is zero."""

    name: str
    at: float | None
    found: float
    known: float
    error: float
    tolerance: float

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance."""
        return self.error <= self.tolerance


def arguments(scene: Scene, stop_time: float | None = None, **changed: Mapping[str, float]) -> dict[str, Any]:
    """Arguments of ``simulate`` for a scene.

    Args:
        stop_time: s; the scene's if None.
        changed: values by name in place of the scene's: ``parameters`` (free ones), ``start``, ``inputs`` (drives).

    Raises:
        StickslipError: a value for something that the scene fixes.
    """
    stop_time = scene.stop_time if stop_time is None else stop_time
    for kind, table in (("parameters", "free"), ("inputs", "drives")):
        for name in changed.get(kind, {}):
            if name in scene.fixed:
                raise StickslipError(
                    f"'{name}' is a constant of scene '{scene.name}'. Move it to [{table}] there to be able to change "
                    "it."
                )
    signals = {name: _signal(d.times, d.values, stop_time) for name, d in scene.drives.items()}
    return {
        "stop_time": stop_time,
        "parameters": {**scene.free, **changed.get("parameters", {})},
        "start": {**scene.start, **changed.get("start", {})},
        "inputs": {**signals, **changed.get("inputs", {})},
    }


def _signal(times: tuple[float, ...], values: tuple[float, ...], stop_time: float) -> float | Signal:
    """A drive over a run: before its first and after its last knot it keeps its value."""
    if len(set(values)) == 1:
        return values[0]
    before = ((0.0,), (values[0],)) if times[0] > 0.0 else ((), ())
    after = ((stop_time,), (values[-1],)) if times[-1] < stop_time else ((), ())
    return Signal((*before[0], *times, *after[0]), (*before[1], *values, *after[1]))


def compute(scene: Scene, fmu: Fmu, progress: Callable[[float], None] | None = None) -> tuple[Row, ...]:
    """Everything the scene asks for, one row per value of what it varies.

    Raises:
        StickslipError: as for ``simulate`` and ``find_orbit``.
    """
    over, values = scene.compute.over, scene.compute.values or (None,)
    rows: list[Row] = []
    start: dict[str, float] = {}
    for i, value in enumerate(values):
        changed: dict[str, Mapping[str, float]] = {"start": start}
        if over is not None and value is not None:
            changed["inputs" if over in scene.drives else "parameters"] = {over: value}
        try:
            row = _KINDS[scene.compute.kind](scene, fmu, arguments(scene, None, **changed))
        except StickslipError as error:
            raise StickslipError(f"At {over} = {value:g}: {error}" if over else str(error)) from error
        rows.append(Row(value, row.values, row.trajectory))
        if scene.compute.follow and row.trajectory is not None:
            start = {name: float(row.trajectory[name][-1]) for name in (*fmu.states, *fmu.memories)}
        if progress:
            progress((i + 1) / len(values))
    return tuple(rows)


def period(scene: Scene, parameters: Mapping[str, float]) -> float:
    """Period of a strobe or orbit, s; ``parameters`` in place of the scene's."""
    how = scene.compute
    if how.forcing is None:
        return how.periods * float(how.period or math.nan)
    value = {**scene.parameters, **parameters}[how.forcing]
    if value <= 0.0:
        raise StickslipError(f"The forcing has no period: {how.forcing} = {value:g}. Choose a positive frequency.")
    return how.periods * (2.0 * math.pi if how.angular else 1.0) / value


def _trajectory(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    times = np.linspace(0.0, run["stop_time"], scene.compute.samples)
    trajectory = simulate(fmu, **run, output_times=times)
    values = {name: float(trajectory[name][-1]) for name in (*fmu.states, *fmu.outputs)}
    for name in (*fmu.states, *fmu.outputs):
        values |= {f"{name}_min": float(trajectory[name].min()), f"{name}_max": float(trajectory[name].max())}
    return Row(None, {**values, "events": float(len(trajectory.events))}, trajectory)


def _cycle(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    from fmu_models.analyses.cycles import last_cycle

    stop_time = run.pop("stop_time")
    cycle = last_cycle(fmu, stop_time, **run)
    if cycle is None:
        row = _trajectory(scene, fmu, {"stop_time": stop_time, **run})
        return Row(None, {"events": 0.0, **{name: row.values[name] for name in fmu.states}}, row.trajectory)
    values = {"period": cycle.period, "events": float(len(cycle.events))}
    for name in fmu.states:
        values |= {f"{name}_min": cycle.minimum[name], f"{name}_max": cycle.maximum[name]}
    values |= {f"{name}_stick": share for name, share in cycle.stick.items()}
    last = np.linspace(cycle.start, cycle.start + cycle.period, scene.compute.samples)
    return Row(None, values, simulate(fmu, float(last[-1]), output_times=last, **run))


def _strobe(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    """Once per period; as many whole periods as fit into the run."""
    length = period(scene, run["parameters"])
    count = int(run["stop_time"] / length * (1.0 + 1e-12))
    if count < 2:
        raise StickslipError(f"The run of {run['stop_time']:g} s is shorter than two periods of {length:g} s.")
    run["stop_time"] = count * length
    trajectory = simulate(fmu, **run, output_times=length * np.arange(count + 1))
    last = np.stack([trajectory[name][-min(KEPT, count) :] for name in fmu.states], axis=1)
    values = {name: float(trajectory[name][-1]) for name in fmu.states}
    return Row(None, {"period": length, "points": float(_different(last)), **values}, trajectory)


def _different(points: np.ndarray) -> int:
    """How many of the points (n, m) differ."""
    size = SAME * np.abs(points).max(axis=0)
    found: list[np.ndarray] = []
    for point in points:
        if not any((np.abs(point - other) <= size).all() for other in found):
            found.append(point)
    return len(found)


def _orbit(scene: Scene, fmu: Fmu, run: dict[str, Any]) -> Row:
    from fmu_models.analyses.orbits import find_orbit

    how = scene.compute
    length = period(scene, run["parameters"])
    guess = {name: float(run["start"].get(name, fmu.variables[name].start or 0.0)) for name in fmu.states}
    fixed = {name: run[name] for name in ("parameters", "inputs")}
    orbit = find_orbit(fmu, length, guess, autonomous=how.autonomous, **fixed)
    values = {"period": orbit.period, **orbit.start, "stable": float(orbit.stable), "residual": orbit.residual}
    for i, multiplier in enumerate(orbit.multipliers, 1):
        values |= {f"multiplier{i}": float(abs(multiplier)), f"multiplier{i}_real": float(multiplier.real)}
    times = np.linspace(0.0, orbit.period, how.samples)
    trajectory = simulate(fmu, orbit.period, start=dict(orbit.start), output_times=times, **fixed)
    return Row(None, values, trajectory)


_KINDS = {"trajectory": _trajectory, "cycle": _cycle, "strobe": _strobe, "orbit": _orbit}


def compare(scene: Scene, rows: tuple[Row, ...]) -> tuple[Comparison, ...]:
    """Results against the references of the scene.

    Raises:
        StickslipError: a reference to a result or a value that there is none of.
    """
    found = []
    for reference in scene.references:
        row = next((row for row in rows if row.at == reference.at), None)
        if row is None:
            at = ", ".join(f"{row.at:g}" for row in rows if row.at is not None) or "no value"
            raise StickslipError(
                f"{scene.path}: a reference is at {reference.at}, the scene computes at {at}. Give each reference the "
                "'at' of its run."
            )
        for name, known in reference.values.items():
            if name not in row.values:
                raise StickslipError(f"{scene.path}: there is no result '{name}'.{nearest(name, row.values)}")
            error = abs(row.values[name] - known) / (abs(known) or 1.0)
            found.append(Comparison(name, row.at, row.values[name], known, error, reference.tolerance))
    return tuple(found)
