"""Runs of a coupled system: all units integrated as one, or stepped one by one."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fmu_models.base.child_process import IsolatedFailure, Limits
from fmu_models.base.errors import StickslipError
from fmu_models.base.processes import isolated
from fmu_models.coupling.composite import Composite
from fmu_models.coupling.cosimulation import co_simulate
from fmu_models.coupling.histories import Vector
from fmu_models.coupling.outcome import News, columns
from fmu_models.coupling.system import BY_STEPS, CoupledSystem
from fmu_models.coupling.wiring import split
from fmu_models.importer import instance, request
from fmu_models.importer.batch import Batch
from fmu_models.importer.driver import Driver
from fmu_models.importer.motion_error import MotionError
from fmu_models.simulation.results import Provenance, Recording
from fmu_models.simulation.trajectory import Trajectory

MASTER_TOLERANCE = 1e-8


class CoupledDriver(Driver):
    """The master's driver with the coupled system in place of an FMU; tolerance, record, on_zeno: as of `Driver`, by
    default what the system says."""

    def __init__(
        self,
        system: CoupledSystem,
        *,
        tolerance: float | None = None,
        record: Sequence[str] | None = None,
        on_zeno: str = "stop",
    ) -> None:
        self.composite = Composite(system, co_simulation=False)
        super().__init__(
            self.composite.fmu,
            method=system.solver,
            tolerance=tolerance or system.tolerance or MASTER_TOLERANCE,
            record=list(system.outputs) or None if record is None else record,
            on_zeno=on_zeno,
        )

    def _load(self) -> instance.Instance:
        # it has what the driver asks of an instance: calls, states, log, message, close
        return self.composite  # pyright: ignore[reportReturnType]

    def _call(self, prepared: Any) -> int:
        if not prepared.c.begun:
            self.composite.write_texts()
        return super()._call(prepared)

    def batch(self, *args: Any, **settings: Any) -> Batch:
        """As of `Driver`; StickslipError: a unit has texts too."""
        for name, unit in self.composite.system.units.items():
            if unit.texts:
                raise StickslipError(f"Unit '{name}' has texts ({', '.join(unit.texts)}), which many runs do not take.")
        return super().batch(*args, **settings)


def couple(
    system: CoupledSystem,
    *,
    output_times: ArrayLike | None = None,
    progress: Callable[[float], None] | None = None,
    limits: Limits | None = None,
) -> Trajectory:
    """Run a coupled system; variables of the trajectory are "unit.variable".

    Args:
        output_times: (n,) s, ascending, within the run; default 1001 equally spaced, in a co-simulation the
            communication points.
        progress: called with the fraction done.
        limits: of a process of its own for the run; None runs here, where a fault of a unit ends this process.

    Raises:
        MotionError: the run cannot be continued; says when and why, and keeps what ran so far.
        StickslipError: a unit lacks what the solver needs.
    """
    if limits is not None:
        return _apart(system, output_times, progress, limits)
    return _here(system, output_times, progress)


def _apart(
    system: CoupledSystem, output_times: ArrayLike | None, progress: Callable[[float], None] | None, limits: Limits
) -> Trajectory:
    """The run in a process of its own, which tells what it does as long as it lives."""
    unit, measured_in, times, rows = "", dict[str, str](), list[float](), list[Vector]()

    def listen(report: float | str | News) -> None:
        nonlocal unit, measured_in
        if isinstance(report, str):
            unit = report
        elif isinstance(report, tuple):
            measured_in = report[0]
            times.extend(report[1])
            rows.extend(report[2])
        elif progress:
            progress(report)

    try:
        return isolated(_here, system, output_times, apart=True, limits=limits, progress=listen)
    except IsolatedFailure as failure:
        last = times[-1] if times else system.start_time
        where = f"unit '{unit}', in its step behind t = {last:.9g} s" if unit else f"the units of '{system.name}'"
        text = f"{where}: {failure} The fault is in the FMU's library, or the run needs more than it may have."
        so_far = Trajectory(np.array(times), columns(measured_in, rows), measured_in, (), len(times), 0, BY_STEPS)
        raise MotionError(text, failure.cause, last).after(so_far) from failure


def _here(
    system: CoupledSystem,
    output_times: ArrayLike | None,
    progress: Callable[[Any], None] | None,
    *,
    apart: bool = False,
) -> Trajectory:
    if not system.units:
        times = request.output_times(output_times, system.start_time, system.stop_time)
        return with_connectors(system, Trajectory(times, {}, {}, (), 0, 0, "values alone, no units"))
    if system.solver == BY_STEPS or (system.solver == "auto" and not system.exchanges_models):
        tell = progress if apart else None
        run = partial(co_simulate, tell=tell)
    else:
        run = _as_one
    try:
        return with_connectors(system, run(system, output_times=output_times, progress=progress))
    except MotionError as error:
        raise _with_cure(error, system) from error


def with_connectors(system: CoupledSystem, trajectory: Trajectory) -> Trajectory:
    """The trajectory with the connectors of the system that have a number, or a source that was recorded."""
    values = {
        name: c.factor * trajectory.values[c.source] + c.offset if c.source else np.full(trajectory.time.size, c.value)
        for name, c in system.connectors.items()
        if c.source in trajectory.values or isinstance(c.value, float)
    }
    units = {name: system.connectors[name].unit or "1" for name in values}
    replaced = {"values": {**trajectory.values, **values}, "units": {**trajectory.units, **units}}
    return replace(trajectory, **replaced) if values else trajectory


def _as_one(
    system: CoupledSystem, output_times: ArrayLike | None, progress: Callable[[float], None] | None
) -> Trajectory:
    """All units integrated as one."""
    solver = system.solver
    if system.step is not None or system.rollback is not None:
        raise StickslipError(
            f"A communication step and 'rollback' belong to '{BY_STEPS}'; '{system.solver}' integrates all units as "
            "one and chooses its steps by the tolerance."
        )
    for name, unit in system.units.items():
        if unit.fmu.description.modelExchange is None:
            raise StickslipError(
                f"The unit '{name}' has no Model Exchange, which '{solver}' needs. Choose the solver '{BY_STEPS}'."
            )
    driver = CoupledDriver(system)
    with driver:
        trajectory = driver.run(
            system.stop_time,
            start_time=system.start_time,
            parameters=system.values("parameters"),
            start=system.values("start"),
            inputs=system.values("inputs"),
            output_times=output_times,
            progress=progress,
        )
        loops = sum(stage.loop for stage in driver.composite.stages)
    note = f"{trajectory.method}; {len(system.units)} units as one"
    if loops:
        note += f", {loops} algebraic loop{'s' if loops > 1 else ''} by Newton's method"
    return replace(trajectory, method=note)


def _with_cure(error: MotionError, system: CoupledSystem) -> MotionError:
    """The error; where contacts chatter it names the rates of fed inputs that they depend on, or that the unit
    takes which is named as a whole, and that nothing feeds."""
    if error.kind != "chattering":
        return error
    taken = {".".join(wire.target) for wire in system.wires} | system.values("inputs").keys()
    missing = [
        f"from {'.'.join(wire.source)}'s rate of change to {rate}"
        for wire in system.wires
        if (rate := f"{'.'.join(wire.target)}_rate") not in taken
        and (rate in error.concerned or (wire.target[0] in error.concerned and _takes(system, *wire.target)))
    ]
    advice = f"Or connect what a contact that sticks has to know: {', '.join(missing)}."
    return error.with_advice(advice) if missing else error


def _takes(system: CoupledSystem, unit: str, name: str) -> bool:
    """Whether the rate of an input is an input, too."""
    rate = system.fmus[unit].variables.get(f"{name}_rate")
    return rate is not None and rate.causality == "input"


def recorded(system: CoupledSystem, trajectory: Trajectory) -> Recording:
    """A run of the system with a description per variable, and where all comes from."""
    descriptions: dict[str, str] = {}
    for name in trajectory.values.keys() - system.connectors.keys():
        unit, variable = split(system.fmus, name, system.name)
        text = system.units[unit].fmu.variables[variable].description
        descriptions |= {name: str(text)} if text else {}
    fmus = list(system.fmus.values())
    provenance = Provenance(
        fmu=", ".join(f"{name}: {fmu.path.name}" for name, fmu in system.fmus.items()),
        model=system.name,
        token=", ".join(str(fmu.description.guid) for fmu in fmus),
        sha256=hashlib.sha256("".join(fmu.sha256 for fmu in fmus).encode()).hexdigest(),
        fmi_version=", ".join(str(fmu.description.fmiVersion) for fmu in fmus),
        generation_tool=", ".join(str(fmu.description.generationTool or "") for fmu in fmus),
        method=system.solver,
        start_time=system.start_time,
        stop_time=system.stop_time,
        tolerance=system.tolerance or float("nan"),
        step=system.step or float("nan"),
        parameters=system.values("parameters"),
        start=system.values("start"),
        inputs={name: value for name, value in system.values("inputs").items() if isinstance(value, (float, int))},
    )
    return Recording(trajectory, descriptions, provenance)
