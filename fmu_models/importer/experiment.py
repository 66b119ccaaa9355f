"""One run of any FMU, as it was asked for, in this process or in one of its own, with a record of where it comes from.

ours, no method named    ->  the engine inside the FMU, in one call
every other              ->  the master, with the method named or the one that fits
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from fmu_models.base.child_process import IsolatedFailure, Limits
from fmu_models.base.errors import StickslipError
from fmu_models.base.processes import isolated
from fmu_models.fmu import library
from fmu_models.importer import texts
from fmu_models.simulation.inputs import signals_of
from fmu_models.simulation.results import SETTINGS, Provenance, Recording
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.simulation.accuracy import ErrorEstimate
    from fmu_models.simulation.trajectory import Trajectory

CO_SIMULATION = "co-simulation"
NATIVE = "taylor"  # the method of the engine inside our FMUs
NATIVE_TOLERANCE = 1e-14  # costs it little
MASTER_TOLERANCE = 1e-8  # below it most models' own rounding and tables show


@dataclass(frozen=True, eq=False)
class FmuExperiment:
    """The experiment that is asked for.

    Attributes:
        stop_time, start_time: s.
        parameters, start, inputs: values by name, in the units of the FMU; inputs as for ``simulate``, a String or
            Binary as ``Driver.run`` takes it.
        output_times: (n,) s, ascending, within the run; default 1001 equally spaced, in a co-simulation the
            communication points.
        tolerance: relative; None takes the default of the method.
        method: of the master; None takes the FMU's own engine where it has one, otherwise "auto".
        step: communication step, s; asks for a co-simulation.
        on_zeno: "stop", "hold" or "continue" where events of an FMU that the master integrates accumulate.
        max_step: s, longest step of the master, as ``Driver`` takes it.
        sides: as for ``simulate``; of runs by the FMU's own engine alone.
    """

    stop_time: float
    start_time: float = 0.0
    parameters: Mapping[str, float | str | bytes] = field(default_factory=dict)
    start: Mapping[str, float | str | bytes] = field(default_factory=dict)
    inputs: Mapping[str, Any] = field(default_factory=dict)
    output_times: ArrayLike | None = None
    tolerance: float | None = None
    method: str | None = None
    step: float | None = None
    on_zeno: str = "stop"
    max_step: float | None = None
    sides: bool = False

    def __post_init__(self) -> None:
        if self.step is not None and self.method is None:
            # whoever names a step means a co-simulation
            object.__setattr__(self, "method", CO_SIMULATION)

    def is_native(self, fmu: Fmu) -> bool:
        """Whether the engine inside the FMU makes the run."""
        return fmu.ours and self.method is None

    def is_co_simulation(self, fmu: Fmu) -> bool:
        """Whether the FMU integrates itself, from one communication point to the next."""
        return self.method == CO_SIMULATION or (not self.is_native(fmu) and fmu.description.modelExchange is None)

    def tolerance_for(self, fmu: Fmu) -> float:
        """The tolerance asked for, or that of the method."""
        if self.tolerance is not None:
            return self.tolerance
        return NATIVE_TOLERANCE if self.is_native(fmu) else MASTER_TOLERANCE


_ADVICE = {
    "time": " Allow it more, or ask for a shorter run.",
    "memory": " Allow it more, or mend the FMU.",
    "killed": "",
    "own": " The fault is in the FMU's library; report it to its author.",
}


def perform(
    fmu: Fmu,
    experiment: FmuExperiment,
    *,
    limits: Limits | None = None,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Make the run.

    Args:
        limits: of a process of its own for the run; None runs here, where a fault of the FMU ends this process.
        progress: called with the fraction done, several times a second.

    Raises:
        StickslipError: what is asked for does not fit the FMU, or the run failed; says when and why.
    """
    if experiment.is_native(fmu) and (experiment.on_zeno != "stop" or experiment.max_step is not None):
        reason = (
            f"whose contacts come to rest; '{experiment.on_zeno}' where events accumulate belongs"
            if experiment.on_zeno != "stop"
            else "which chooses its steps; a longest step belongs"
        )
        raise StickslipError(
            f"'{fmu.path}' runs by its own engine, {reason} to the master. Leave it out, or choose a method."
        )
    words, _ = texts.settings(fmu, experiment.parameters, experiment.start, experiment.inputs)
    # the bytes that were set, rather than the name of their file
    settings = {n: {k: words.get(k, v) for k, v in getattr(experiment, n).items()} for n in SETTINGS} if words else {}
    settings["inputs"] = {**experiment.inputs, **settings.get("inputs", {})}
    others = {name: value for name, value in settings["inputs"].items() if name not in words}
    settings["inputs"] |= signals_of(fmu, others, experiment.start_time, experiment.stop_time)
    experiment = replace(experiment, **settings)
    if limits is not None or not experiment.is_native(fmu):
        _build_libraries(fmu, master=not experiment.is_native(fmu))
    if limits is None:
        trajectory = _run(fmu, experiment, progress=progress)
    else:
        try:
            trajectory = isolated(_run, fmu, experiment, limits=limits, progress=progress)
        except IsolatedFailure as failure:
            text = f"{fmu.description.modelName}: {failure}{_ADVICE[failure.cause]}"
            raise IsolatedFailure(text, failure.cause, failure.code) from failure
    return _recorded(fmu, experiment, trajectory)


def perform_with_error(
    fmu: Fmu,
    experiment: FmuExperiment,
    *,
    limits: Limits | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Recording, ErrorEstimate]:
    """Make the run, and four more that say how far it can be trusted. StickslipError: as for ``perform``, or the run is
    not made by the engine inside the FMU, in this process."""
    from fmu_models.simulation.accuracy import simulate_with_error

    if not experiment.is_native(fmu) or limits is not None:
        raise StickslipError(
            "The error is estimated for runs by the engine inside an FMU of this suite, in this process. Leave out "
            "--error, or --method, --step and --isolate."
        )
    trajectory, estimate = simulate_with_error(**_arguments(fmu, experiment), sides=experiment.sides, progress=progress)
    return _recorded(fmu, experiment, trajectory), estimate


def _run(fmu: Fmu, experiment: FmuExperiment, progress: Callable[[float], None] | None = None) -> Trajectory:
    if experiment.is_native(fmu):
        return simulate(**_arguments(fmu, experiment), sides=experiment.sides, progress=progress)
    from fmu_models.importer.simulate import simulate_any  # the master, which our own FMUs run without

    return simulate_any(
        **_arguments(fmu, experiment),
        method=experiment.method or "auto",
        communication_step=experiment.step,
        on_zeno=experiment.on_zeno,
        max_step=experiment.max_step,
        progress=progress,
    )


def _arguments(fmu: Fmu, experiment: FmuExperiment) -> dict[str, Any]:
    """What every way to make the run takes."""
    names = ("stop_time", "start_time", "parameters", "start", "inputs", "output_times")
    settings = {name: getattr(experiment, name) for name in names}
    return {"fmu": fmu, "tolerance": experiment.tolerance_for(fmu), **settings}


def _build_libraries(fmu: Fmu, *, master: bool) -> None:
    """Here rather than in the child: a compiler is no work of the FMU, and needs more memory than one."""
    if master:
        from fmu_models.importer.instance import master_library

        master_library()
    stated = fmu.description
    for interface in (stated.modelExchange, stated.coSimulation, stated.scheduledExecution):
        if interface is not None:
            library.library(fmu, str(interface.modelIdentifier))


def _recorded(fmu: Fmu, experiment: FmuExperiment, trajectory: Trajectory) -> Recording:
    recorded = (*trajectory.values, *trajectory.arrays)
    descriptions = {name: fmu.variables[name].description for name in recorded if name in fmu.variables}
    # an input that varies is in the trajectory itself
    inputs = {
        name: value if isinstance(value, (str, bytes)) else float(value)
        for name, value in experiment.inputs.items()
        if not isinstance(value, Signal)
    }
    provenance = partial(
        Provenance.of,
        fmu,
        NATIVE if experiment.is_native(fmu) else experiment.method or "auto",
        experiment.start_time,
        experiment.stop_time,
        tolerance=experiment.tolerance_for(fmu),
        step=float("nan") if experiment.step is None else experiment.step,
        parameters=dict(experiment.parameters),
        start=dict(experiment.start),
        inputs=inputs,
    )
    return Recording(trajectory, {name: text for name, text in descriptions.items() if text}, provenance)
