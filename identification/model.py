"""The fitted model, run: the rig's FMU with the fitted friction law, at the drive speed of a log."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.errors import StickslipError
from identification.laws import find_law
from identification.pooling import Pool, RigValues, pool, rig_values
from identification.portraits import PortraitComparison, compare_portraits, portrait
from identification.result import FrictionFit
from rig_io.log import RigLog

if TYPE_CHECKING:
    from fmu_models.scene.scene import Scene
    from fmu_models.simulation.fmu import Fmu

TRANSIENT = 30.0  # natural periods left out: starts die out with c/(2J), which takes some ten on a weakly damped rig

SAME_RIG = 0.02  # relative difference of a constant up to which a later, better measurement explains it


@dataclass(frozen=True, eq=False)
class SimulatedMotion:
    """time: (n,) s from 0; angle: (n,) rad; speed: (n,) rad/s; transient left out."""

    time: np.ndarray
    angle: np.ndarray
    speed: np.ndarray


Simulator = Callable[[float, float, float], SimulatedMotion]
"""drive speed rad/s, duration s, sample interval s -> motion."""


def fmu_simulator(fit: FrictionFit) -> Simulator:
    """The FMU of the disc rig with one disc in contact, under the fitted law and the constants that the fit used.

    Raises:
        StickslipError: the law is unknown, or its values are out of the model's range.
    """
    from fmu_models.codegen.package import built
    from fmu_models.simulation.fmu import Fmu

    return _simulator(fit, lambda: Fmu.open(built("disc_rig", contacts=fit.contacts, laws=fmu_laws(fit))), {})


def scene_simulator(fit: FrictionFit, scene: Scene) -> Simulator:
    """The FMU of a scene with the fitted law and constants in place of its own; its start, its laws, its other values.

    Raises:
        StickslipError: the scene is not of the contact that was fitted alone, or varies it otherwise.
    """
    from fmu_models.scene.reduce import built_scene, unfolded
    from fmu_models.simulation.fmu import Fmu

    if scene.contacts != fit.contacts:
        used = ", ".join(scene.contacts) if scene.contacts else ("all" if scene.contacts is None else "none")
        raise StickslipError(
            f"The fit is of '{fit.contacts[0]}' alone, scene '{scene.name}' has as contacts in use: {used}. Set "
            f'contacts = ["{fit.contacts[0]}"] there.'
        )
    values = fmu_parameters(fit)
    missing = [name for name in values if name not in scene.parameters]
    if missing:
        raise StickslipError(f"Scene '{scene.name}' has no parameter '{missing[0]}', which was fitted.")
    free = unfolded(scene)
    fixed = {name: value for name, value in free.fixed.items() if name not in values}
    free = dataclasses.replace(free, fixed=fixed, free={**free.free, **values}, outputs=())
    return _simulator(fit, lambda: Fmu.open(built_scene(free)), scene.start)


def _simulator(fit: FrictionFit, opened: Callable[[], Fmu], start: Mapping[str, float]) -> Simulator:
    """Runs of an FMU with the fitted values, after a transient; ``start`` in place of stick at rest."""
    rig = fitted_rig(fit)

    def run(drive_speed: float, duration: float, step: float) -> SimulatedMotion:
        from fmu_models.simulation.system import simulate

        disc = fit.contacts[0][-1]
        transient = TRANSIENT * 2 * np.pi * float(np.sqrt(rig.J / rig.k))
        times = transient + step * np.arange(round(duration / step) + 1)
        trajectory = simulate(
            opened(),
            float(times[-1]),
            parameters=fmu_parameters(fit),
            start={"theta": 0.0, "omega": rig.r * drive_speed / rig.R, **start},
            inputs={f"w{disc}": drive_speed},
            output_times=times,
        )
        return SimulatedMotion(times - transient, trajectory["theta"], trajectory["omega"])

    return run


def fitted_rig(fit: FrictionFit) -> RigValues:
    """The constants of the rig with which a law was fitted."""
    return rig_values({one.name: one.value for one in (*fit.constants, *fit.nuisance)})


def fmu_laws(fit: FrictionFit) -> dict[str, str] | None:
    """The law of the rig's FMU that simulates the fitted one, by contact; None for the law that the rig has."""
    model = find_law(fit.law).model
    return None if model is None else dict.fromkeys(fit.contacts, model)


def fmu_parameters(fit: FrictionFit) -> dict[str, float]:
    """Parameters of the rig's FMU by name: fitted law and constants, for `simulate` or for an FMU to hand on."""
    rig, disc = fitted_rig(fit), fit.contacts[0][-1]
    constants = {"J": rig.J, "k": rig.k, "c": rig.c, "R": rig.R, "r": rig.r, f"N{disc}": rig.N}
    law = find_law(fit.law).simulated(fit.law_values, rig.N)
    return constants | {f"{name}{disc}": value for name, value in law.items()}


def compare(
    fit: FrictionFit, logs: Sequence[RigLog], *, simulate: Simulator | None = None
) -> tuple[PortraitComparison, ...]:
    """Measured against modelled phase portrait of each stick-slip log, at its mean drive speed.

    logs: of the rig of the fit, not necessarily those fitted; a free decay among them gives the zero of the angle.
    simulate: runs the model; the rig's FMU if None.

    Raises:
        StickslipError: a log that `pool` refuses, a log of another rig, or a model without a cycle.
    """
    ready = pool(logs, allow_no_stick=True)
    _check_same_rig(fit, ready)
    run = fmu_simulator(fit) if simulate is None else simulate
    rig = fitted_rig(fit)
    shape = {"r": rig.r, "R": rig.R, "natural_period": float(2 * np.pi * np.sqrt(rig.J / rig.k))}
    comparisons = []
    for motion in ready.motions:
        drive_speed = float(np.mean(motion.drive))
        measured = portrait(motion.time, motion.angle, motion.drive, what=f"log '{motion.log.name}'", **shape)
        modelled = run(drive_speed, motion.time[-1] - motion.time[0], motion.step)
        drive = np.full(len(modelled.time), drive_speed)
        what = f"the model at {drive_speed:.3g} rad/s"
        model = portrait(modelled.time, modelled.angle, drive, what=what, **shape)
        comparisons.append(
            PortraitComparison(motion.log.name, drive_speed, measured, model, compare_portraits(measured, model))
        )
    return tuple(comparisons)


def _check_same_rig(fit: FrictionFit, ready: Pool) -> None:
    if ready.contacts != fit.contacts:
        raise StickslipError(
            f"The fit is of '{fit.contacts[0]}', the logs are of '{ready.contacts[0]}'. Compare like with like."
        )
    if fit.materials and ready.materials and fit.materials != ready.materials:
        raise StickslipError(
            f"The fit is of {' / '.join(fit.materials)}, the logs are of {' / '.join(ready.materials)}. Compare like "
            "with like."
        )
    fitted, logged = fitted_rig(fit), ready.values
    for name in ("J", "R", "r", "N"):
        there, here = getattr(fitted, name), getattr(logged, name)
        if abs(here / there - 1) > SAME_RIG:
            raise StickslipError(
                f"The fit is of a rig with {name} = {there:g}, the logs are of one with {here:g} (SI units). Compare "
                "like with like."
            )
