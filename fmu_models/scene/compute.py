"""What a scene computes, through its FMU, and how that compares with what is known of it."""

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.kinds import KINDS
from fmu_models.scene.kinds.kind import Row
from fmu_models.scene.scene import Scene
from fmu_models.simulation.signal import Signal

MANY = 20  # values that an error lists


@dataclass(frozen=True)
class Comparison:
    """A result against its known value, and whose that is; error relative to it, absolute where it is zero.

    departs: the value is known of other constants, and not compared.
    """

    name: str
    at: float | None
    found: float
    known: float
    error: float
    tolerance: float
    source: str = ""
    departs: bool = False
    panel: float | None = None

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance, where there is one."""
        return self.departs or self.error <= self.tolerance


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
    """Everything the scene asks for, one row per value of what it varies, in each of its panels.

    Errors as for ``simulate`` and ``find_orbit``.
    """
    report = progress or (lambda fraction: None)
    panels = [(name, value) for name, values in scene.compute.panels.items() for value in values]
    if not panels:
        return _computed(scene, fmu, {}, report)
    rows: list[Row] = []
    for k, (name, value) in enumerate(panels):
        computed = _computed(scene, fmu, {name: value}, lambda fraction, k=k: report((k + fraction) / len(panels)))
        rows += [dataclasses.replace(row, panel=value) for row in computed]
        report((k + 1) / len(panels))
    return tuple(rows)


def _computed(scene: Scene, fmu: Fmu, held: dict[str, float], progress: Callable[[float], None]) -> tuple[Row, ...]:
    """One row per value of what is varied, while other quantities are held."""
    kind = KINDS.load(scene.compute.kind, scene.folder)
    if kind.sweeps:
        computed = kind.compute(scene, fmu, arguments(scene, None, **_changed(scene, held)))
        return computed if isinstance(computed, tuple) else (computed,)
    over, values = scene.compute.over, scene.compute.values or (None,)
    rows: list[Row] = []
    start: dict[str, float] = {}
    for i, value in enumerate(values):
        varied = held if over is None or value is None else {**held, over: value}
        try:
            row = kind.compute(scene, fmu, arguments(scene, None, start=start, **_changed(scene, varied)))
        except StickslipError as error:
            raise StickslipError(f"At {over} = {value:g}: {error}" if over else str(error)) from error
        assert isinstance(row, Row)  # of what does not sweep
        rows.append(dataclasses.replace(row, at=value))
        if scene.compute.follow and row.trajectory is not None:
            start = {name: float(row.trajectory[name][-1]) for name in (*fmu.states, *fmu.memories)}
        progress((i + 1) / len(values))
    return tuple(rows)


def _changed(scene: Scene, values: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """Values by name as ``arguments`` takes them."""
    inputs = {name: value for name, value in values.items() if name in scene.drives}
    return {"inputs": inputs, "parameters": {name: v for name, v in values.items() if name not in inputs}}


def compare(scene: Scene, rows: tuple[Row, ...]) -> tuple[Comparison, ...]:
    """Results against the references of the scene. StickslipError: a reference to a result or a value that there is
    none of."""
    comparisons, departs = [], bool(scene.departs)
    for reference in scene.references:
        panel = [row for row in rows if _same(row.panel, reference.panel)]
        row = next((row for row in panel if _same(row.at, reference.at)), None)
        if row is None:
            if not panel:
                panels = ", ".join(f"{value:g}" for values in scene.compute.panels.values() for value in values)
                raise StickslipError(
                    f"{scene.path}: a reference is in panel {reference.panel}; panels are {panels or 'not computed'}. "
                    "Give each reference the 'panel' that it is of."
                )
            places = [f"{row.at:g}" for row in panel if row.at is not None] or ["no value"]
            at = ", ".join(places if len(places) < MANY else [*places[:2], "...", places[-1]])
            raise StickslipError(
                f"{scene.path}: a reference is at {reference.at}, the scene computes at {at}. Give each reference the "
                "'at' of its run."
            )
        for name, expected in reference.values.items():
            if not departs:
                refuse_unknown(name, row.values, f"{scene.path}: there is no result '{name}'.")
            computed = row.values.get(name, math.nan)
            error = math.nan if departs else abs(computed - expected) / (abs(expected) or 1.0)
            whose = reference.tolerance, reference.source, departs, reference.panel
            comparisons.append(Comparison(name, row.at, computed, expected, error, *whose))
    return tuple(comparisons)


def _same(first: float | None, second: float | None) -> bool:
    """Whether two values of what is varied are one, up to the rounding of an evenly spaced range."""
    return first is second or (first is not None and second is not None and math.isclose(first, second, rel_tol=1e-12))
