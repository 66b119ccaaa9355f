"""The fitted model, run: the rig's FMU under the fitted friction law, with the constants that the fit used."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Shown
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.scene import Scene
from fmu_models.simulation.trajectory import Event, Trajectory
from identification.fit.result import FrictionFit
from identification.laws import bristled, find_law
from identification.measurement.pooled import RigValues, rig_values
from rig_io.logs.arrangement import CHANGEOVER, MODELS, Arrangement
from rig_io.logs.log import RigLog

TRANSIENT = 30.0  # natural periods left out: starts die out with c/(2J), which takes some ten on a weakly damped rig
AT_REST = 1e-12  # rad, up to which the angle of rest is found
SAME_RIG = 0.02  # relative difference of a constant up to which a later, better measurement explains it
NUDGE = 1e-5  # rad/s, to either side, for the damping of steady sliding: error 1e-9 of it

AGEING = "ageing"  # the law of the FMU whose breakaway ages
BRISTLES = ("lugre", "lugre_stribeck")  # the laws of the FMU that never stick exactly


@dataclass(frozen=True, eq=False)
class SimulatedMotion:
    """Motion after the transient. time: (n,) s from 0; angle: (n,) rad; speed: (n,) rad/s; states: per contact (n,) its
    state (0: stick); events: with times on the same clock; end: the states at the end, to start another run from."""

    time: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    states: Mapping[str, np.ndarray]
    events: tuple[Event, ...]
    end: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class FittedModel(Shown):
    """The FMU of the rig and the values it runs with.

    contacts: discs that touch; arrangement: of two discs, as in `logs.log.Experiment`; parameters: of the FMU, by
    name; start: of states, in place of stick on the first disc; sticks: whether the law knows exact stick;
    steady: the law without bristles, where it is not that of the rig.
    """

    fmu: Fmu
    contacts: tuple[str, ...]
    arrangement: Arrangement
    parameters: Mapping[str, float]
    start: Mapping[str, float]
    sticks: bool
    steady: str = ""

    @cached_property
    def natural_period(self) -> float:
        """2 pi sqrt(J/k), s."""
        return float(2 * np.pi * np.sqrt(self.parameters["J"] / self.parameters["k"]))

    @property
    def changeover(self) -> float:
        """Angle at which contact changes, rad; 0 where it does not."""
        return self.parameters.get(CHANGEOVER.get(self.arrangement, ""), 0.0)

    def with_parameters(self, parameters: Mapping[str, float]) -> FittedModel:
        """The same model with other values; those of other models are left out."""
        return replace(self, parameters={name: parameters[name] for name in self.parameters})

    def states_at(
        self, drive_speeds: Mapping[str, float], time: float, start: Mapping[str, float] | None = None
    ) -> tuple[dict[str, float], Sequence[Event]]:
        """States at a time (s) after a start, and the events until then. StickslipError: values out of the model's
        range."""
        run = self._trajectory(drive_speeds, np.array([time]), start)
        states = {name: float(run[name][-1]) for name in self.fmu.states}
        modes = {f"{contact}_state": float(run[f"{contact}_state"][-1]) for contact in self.contacts}
        return states | modes, run.events

    def run(
        self,
        drive_speeds: Mapping[str, float],
        duration: float,
        step: float,
        *,
        transient: float = TRANSIENT,
        start: Mapping[str, float] | None = None,
    ) -> SimulatedMotion:
        """Motion at steady drive speeds (rad/s, by contact), sampled every ``step`` s.

        transient: natural periods before; start: states to start from in place of the model's own.

        Raises:
            StickslipError: values out of the model's range.
        """
        before = transient * self.natural_period
        times = before + step * np.arange(max(round(duration / step), 1) + 1)
        trajectory = self._trajectory(drive_speeds, times, start)
        states = {contact: trajectory[f"{contact}_state"] for contact in self.contacts}
        events = tuple(replace(e, time=e.time - before) for e in trajectory.events if e.time >= before)
        end = {name: float(trajectory[name][-1]) for name in self.fmu.states}
        return SimulatedMotion(times - before, trajectory["theta"], trajectory["omega"], states, events, end)

    def _trajectory(
        self, drive_speeds: Mapping[str, float], times: np.ndarray, start: Mapping[str, float] | None
    ) -> Trajectory:
        from fmu_models.simulation.run import simulate

        if start is None:  # stick on the first disc, near where it lets go, so that one release leads onto the cycle
            speed = self.parameters["r"] * drive_speeds[self.contacts[0]] / self.parameters["R"]
            start = {"theta": 0.0, "omega": speed, **self.start}
        how = {"parameters": self.parameters, "start": start, "inputs": inputs(drive_speeds)}
        return simulate(self.fmu, float(times[-1]), output_times=times, **how)

    def sliding(self, drive_speeds: Mapping[str, float]) -> Sliding | None:
        """Steady sliding: where the body rests, and its damping there; None where it cannot rest in slip.

        A law with bristles is taken at its steady friction.
        """
        if any(speed == 0.0 for speed in drive_speeds.values()):
            return None
        angle = 0.0
        for _ in range(3):  # the first is exact but where which disc touches depends on the angle
            shift = self._acceleration(drive_speeds, angle, 0.0) * self.parameters["J"] / self.parameters["k"]
            if abs(shift) <= AT_REST:
                break
            angle += shift
        else:
            return None
        above, below = (self._acceleration(drive_speeds, angle, sign * NUDGE) for sign in (1.0, -1.0))
        return Sliding(angle, -self.parameters["J"] * (above - below) / (2 * NUDGE))

    def _acceleration(self, drive_speeds: Mapping[str, float], angle: float, speed: float) -> float:
        """Angular acceleration, rad/s^2."""
        from fmu_models.simulation.run import simulate

        rigid = self if self.sticks else self._rigid
        run = simulate(
            rigid.fmu,
            1e-9,
            parameters=rigid.parameters,
            start={"theta": angle, "omega": speed},
            inputs=inputs(drive_speeds),
            output_times=[0.0],
        )
        return float(run["der(omega)"][0])

    @cached_property
    def _rigid(self) -> FittedModel:
        """The model without bristles."""
        laws = dict.fromkeys(self.contacts, self.steady) if self.steady else {}
        fmu = _built(MODELS[self.arrangement], self.contacts, laws)
        values = {name: value for name, value in self.parameters.items() if name in fmu.parameters}
        return replace(self, fmu=fmu, parameters=values, start={}, sticks=True)


@dataclass(frozen=True)
class Sliding:
    """Steady sliding. angle: rad, at rest; damping: N m s/rad of small motions about it (stable where positive)."""

    angle: float
    damping: float


def inputs(drive_speeds: Mapping[str, float]) -> dict[str, float]:
    """Inputs of the rig's FMU from drive speeds (rad/s) by contact."""
    return {f"w{contact[-1]}": speed for contact, speed in drive_speeds.items()}


def arrangement_of(fit: FrictionFit) -> Arrangement:
    """How two discs touch: the fit says it by the name of the angle at which contact changes."""
    names = {*(q.name for q in fit.parameters), *(q.name for q in fit.constants)}
    for name, angle in CHANGEOVER.items():
        if angle in names:
            return name
    return "together"


def fitted_model(
    fit: FrictionFit, scene: Scene | None = None, contacts: tuple[str, ...] | None = None, *, fmi_version: str = "3.0"
) -> FittedModel:
    """The rig's FMU with the fitted values, or that of a scene of the same discs with these in place of its own.

    contacts: those in use, of the fitted ones; all if None.

    Raises:
        StickslipError: the law is unknown, or the scene is not of the discs that were fitted.
    """
    contacts = contacts or fit.contacts
    arrangement = arrangement_of(fit) if len(contacts) > 1 else "together"
    law = find_law(fit.law_reference)
    if scene is not None:
        fmu, start = _of_scene(fit, scene, contacts)
    else:
        laws = dict.fromkeys(contacts, law.reference)
        fmu, start = _built(MODELS[arrangement], contacts, laws, fmi_version), {}
    sticks = law.sticks and not (scene is not None and any(name in BRISTLES for name in scene.laws.values()))
    values = {name: value for name, value in fmu_parameters(fit).items() if name in fmu.parameters}
    pair = bristled(law)
    steady = pair[0].reference if pair and not law.sticks else ""
    return FittedModel(fmu, contacts, arrangement, values, start, sticks, steady)


def _built(model: str, contacts: Sequence[str], laws: Mapping[str, str], fmi_version: str = "3.0") -> Fmu:
    from fmu_models.codegen.package import built
    from fmu_models.fmu.fmu import Fmu

    return Fmu.open(built(model, contacts=contacts, laws=laws or None, fmi_version=fmi_version))


def _of_scene(fit: FrictionFit, scene: Scene, contacts: tuple[str, ...]) -> tuple[Fmu, Mapping[str, float]]:
    """The FMU of a scene whose fitted parameters are free, and its start."""
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.scene.reduce import built_scene, unfolded

    used = ("disc0", "disc1") if scene.contacts is None else scene.contacts
    if used != contacts:
        listed = ", ".join(f'"{name}"' for name in contacts)
        raise StickslipError(
            f"The fit is of {' and '.join(contacts)}, scene '{scene.name}' has as contacts in use: "
            f"{', '.join(used) or 'none'}. Set contacts = [{listed}] there."
        )
    values = fmu_parameters(fit)
    missing = [name for name in values if name not in scene.parameters]
    if missing:
        raise StickslipError(f"Scene '{scene.name}' has no parameter '{missing[0]}', which was fitted.")
    free = unfolded(scene)
    fixed = {name: value for name, value in free.fixed.items() if name not in values}
    free = dataclasses.replace(free, fixed=fixed, free={**free.free, **values}, outputs=())
    return Fmu.open(built_scene(free)), scene.start


def fitted_rig(fit: FrictionFit) -> RigValues:
    """The constants of the rig with which a law was fitted."""
    return rig_values({constant.name: constant.value for constant in (*fit.constants, *fit.nuisance)})


def rig_constants(fit: FrictionFit) -> dict[str, float]:
    """Constants by the names of the rig's FMU: J, k, c, R, r, N0, N1."""
    rig = fitted_rig(fit)
    forces = {f"N{contact[-1]}": force for contact, force in zip(fit.contacts, rig.forces, strict=True)}
    return {"J": rig.J, "k": rig.k, "c": rig.c, "R": rig.R, "r": rig.r, **forces}


def fmu_parameters(fit: FrictionFit) -> dict[str, float]:
    """Parameters of the rig's FMU by name, in its units: fitted law and constants, for `simulate` or for an FMU to hand
    on."""
    values, law = rig_constants(fit), find_law(fit.law_reference)
    contacts = fit.contacts
    for contact in contacts:
        number = contact[-1]
        # of two discs the names end in the number of theirs, as those of the FMU do
        suffix = number if len(contacts) > 1 else ""
        values |= {f"{name}{number}": fit[f"{name}{suffix}"].value for name in law.names}
        if fit.breakaway and fit.breakaway.growth is not None and law.reference == AGEING:
            values[f"b{number}"] = max(fit.breakaway.growth, 0.0)
    for parameter in (*fit.parameters, *fit.constants, *fit.nuisance):
        if parameter.name in CHANGEOVER.values():
            values[parameter.name] = parameter.value
    return values


def check_rig_of(fit: FrictionFit, contacts: Sequence[str], logs: Sequence[RigLog]) -> None:
    """Refuse logs of another rig, of other discs or materials than those of a fit."""
    fitted, first = fit.contacts, logs[0]
    if not set(contacts) <= set(fitted):
        raise StickslipError(
            f"The fit is of {' and '.join(fitted)}, log '{first.name}' is of {' and '.join(contacts)}. Compare like "
            "with like."
        )
    if len(contacts) > 1 and first.experiment.arrangement != arrangement_of(fit):
        raise StickslipError(
            f"The fit is of discs arranged '{arrangement_of(fit)}', log '{first.name}' of discs arranged "
            f"'{first.experiment.arrangement}'. Compare like with like."
        )
    pairs = dict(zip(fitted, fit.materials, strict=False))
    for log in logs:
        for contact, pair in zip(contacts, log.experiment.materials, strict=False):
            if pairs.get(contact, pair) != pair:
                raise StickslipError(
                    f"The fit is of {pairs[contact]} on {contact}, log '{log.name}' is of {pair}. Compare like with "
                    "like."
                )
    constants = rig_constants(fit)
    forces = (f"N{contact[-1]}" for contact in contacts if not first.has(f"load{contact[-1]}"))
    for name in ("J", "R", "r", *forces):
        model, logged = constants[name], first.rig.value(name)
        if abs(logged / model - 1) > SAME_RIG:
            raise StickslipError(
                f"The fit is of a rig with {name} = {model:g}, the logs are of one with {logged:g} (SI units). Compare "
                "like with like."
            )
