"""The bench's oscillator: which FMU, with which parameters and inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.simulation.signal import Signal
from rig_io.bench.disturbances import disturbed_oscillator
from rig_io.bench.emulation import TRUTH_RATE, Emulation
from rig_io.bench.materials import CONTI
from rig_io.logs.arrangement import CHANGEOVER, MODELS
from rig_io.sensors.motion import Motion

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu

Turning = tuple[np.ndarray, np.ndarray, float]
"""Of a drive: knots (n,) in s, speeds (n,) in rad/s, and its angle (rad) at the first."""


def simulated(
    settings: Emulation, drives: Sequence[Turning], total: float, loads: Mapping[str, Signal] = MappingProxyType({})
) -> Motion:
    """The disc's motion at `TRUTH_RATE`; it starts in stick with disc 0, whence one release leads onto the cycle."""
    from fmu_models.simulation.run import simulate

    fmu, parameters, start_values = _oscillator(settings)
    rig = settings.rig
    start = {"theta": settings.start_angle, "omega": 0.0}
    if drives and not settings.at_rest:
        start["omega"] = rig.value("r") * float(drives[0][1][0]) / rig.value("R")
    start |= start_values
    samples = int(np.ceil(total * TRUTH_RATE - 1e-9)) + 1
    trajectory = simulate(
        fmu,
        total,
        parameters=parameters,
        start=start,
        inputs={f"w{i}": Signal(time, speed) for i, (time, speed, _) in enumerate(drives)} | dict(loads),
        output_times=np.linspace(0.0, total, samples),
    )
    return Motion(trajectory.time, trajectory["theta"], trajectory["omega"])


def _oscillator(settings: Emulation) -> tuple[Fmu, Mapping[str, float], Mapping[str, float]]:
    """The FMU, values of its parameters, and start values that are given: those of the scene, if there is one."""
    from fmu_models.fmu.fmu import Fmu

    if settings.scene is not None:
        from fmu_models.scene.reduce import built_scene, unfolded

        scene = unfolded(settings.scene)
        return Fmu.open(built_scene(scene)), scene.free, scene.start
    if (moved := settings.disturbances) is not None and (settings.discs or moved.moves):
        law = next(iter(_laws(settings).values()), "")
        own = {name: value for name, value in moved.parameters.items() if law or not name.startswith("g")}
        return disturbed_oscillator(law), _parameters(settings) | own, {}
    from fmu_models.codegen.package import built

    laws = {contact: law for contact, law in _laws(settings).items() if law != CONTI}
    fmu = Fmu.open(built(MODELS[settings.arrangement], contacts=settings.contacts, laws=laws))
    return fmu, _parameters(settings), {}


def _laws(settings: Emulation) -> dict[str, str]:
    """The law of each contact."""
    laws = (disc.material.law if settings.micro_slip is None else "lugre" for disc in settings.discs)
    return dict(zip(settings.contacts, laws, strict=True))


def _parameters(settings: Emulation) -> dict[str, float]:
    """The parameters of the FMU, by name."""
    named = {name: settings.rig.value(name) for name in ("J", "k", "c", *(("R", "r") if settings.discs else ()))}
    for i, disc in enumerate(settings.discs):
        law = dict(disc.material.values)
        if settings.micro_slip is not None:
            law |= {"sigma0": settings.micro_slip.stiffness, "sigma1": settings.micro_slip.damping}
        named |= {f"{name}{i}": value for name, value in law.items()}
        named[f"N{i}"] = settings.rig.value(f"N{i}")
    if settings.arrangement in CHANGEOVER:
        named[CHANGEOVER[settings.arrangement]] = settings.changeover
    return named
