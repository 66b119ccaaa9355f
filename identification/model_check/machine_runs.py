"""A machine with what logs said of it, run beside logs: the engine moves it by the measured efforts, from the measured
state at the begin of every window."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.record import Recorded
from fmu_models.base.shown import Shown
from fmu_models.language.mechanism import Mechanism
from identification.fitted_model.machine import machine_with
from identification.machines.machine_fit import MachineFit
from identification.machines.motion import LEAST_TRAVEL, JointMotion, MachineLog, motions
from identification.machines.predicted import cutoffs_of
from identification.machines.regressor import effort_inputs
from identification.machines.scores import FREE_RUN

if TYPE_CHECKING:
    from fmu_models.simulation.trajectory import Trajectory

    Runs = Callable[..., Trajectory]

EVERY = 0.01  # s, between samples that are compared


@dataclass(frozen=True)
class JointRun:
    """rms error of a simulated position, in its unit, and over the standard deviation of the measured one; None where
    every run was given up, or the joint did not move."""

    joint: str
    unit: str
    error: float | None
    relative: float | None


@dataclass(frozen=True, eq=False)
class MachineRun(Shown, Recorded):
    """A log beside the machine. time: (n,) s; measured, simulated: (n, joints), NaN where a run was given up; ends: of
    windows, among the samples; window: s; joints: how far they are apart; given_up: why runs ended early."""

    RECORD = ("log", "window", "joints", "given_up")

    log: str
    window: float
    time: np.ndarray
    measured: np.ndarray
    simulated: np.ndarray
    ends: np.ndarray
    joints: tuple[JointRun, ...]
    given_up: tuple[str, ...]


def machine_runs(
    mechanism: Mechanism,
    fit: MachineFit,
    logs: Sequence[MachineLog],
    *,
    window: float = FREE_RUN,
    progress: Callable[[float], None] | None = None,
) -> list[MachineRun]:
    """Run the machine beside each log, window (s) after window. StickslipError: as in `machine_with` and `motions`, or
    a log holds no window."""
    from fmu_models.codegen.package import built
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.simulation.run import KeptRun

    if not window > 0:
        raise StickslipError(f"A window of {window:g} s holds no motion: give it a length, such as 1 s.")
    report = progress if progress is not None else lambda _: None
    pieces = motions(logs, [q.name for q in mechanism.coordinates], cutoffs_of(fit))
    if not any(piece.position.any() for piece in pieces):
        raise StickslipError("The logs hold no positions beside which the machine could be run.")
    values = {p.name: p.value for p in machine_with(mechanism, fit).parameters}
    # one FMU for all fits of the machine, which is compiled once
    plain = dataclasses.replace(
        fit, parameters=tuple(dataclasses.replace(parameter, value=1.0) for parameter in fit.parameters)
    )
    fmu = Fmu.open(built(machine_with(mechanism, plain)))
    runs = []
    with KeptRun(fmu) as simulation:
        run = partial(simulation, parameters=values)
        for number, log in enumerate(logs):
            mine = [piece for piece in pieces if piece.log == number]
            runs.append(_run(mechanism, run, log.name, mine, window))
            report((number + 1) / len(logs))
    return runs


def _run(mechanism: Mechanism, run: Runs, name: str, pieces: Sequence[JointMotion], window: float) -> MachineRun:
    times, measured, simulated, notes = [], [], [], []
    for piece in pieces:
        length = round(window / piece.step)
        for start in range(piece.span.start, piece.span.stop - length, length):
            rows = slice(start, start + length + 1)
            motion, why = _window(mechanism, run, piece, rows)
            every = max(round(EVERY / piece.step), 1)
            times.append(piece.time[rows][::every])
            measured.append(piece.position[rows][::every])
            simulated.append(motion[::every])
            notes += why
    if not times:
        raise StickslipError(f"'{name}' holds no window of {window:g} s. Give a shorter one: --window.")
    logged, model = np.concatenate(measured), np.concatenate(simulated)
    spread = np.std(logged, axis=0)
    joints = []
    for joint, q in enumerate(mechanism.coordinates):
        off = (model - logged)[:, joint]
        error = float(np.sqrt(np.nanmean(off**2))) if np.isfinite(off).any() else None
        relative = None if error is None or spread[joint] < LEAST_TRAVEL else error / float(spread[joint])
        joints.append(JointRun(q.name, q.unit, error, relative))
    ends = np.cumsum([len(time) for time in times]) - 1
    return MachineRun(name, window, np.concatenate(times), logged, model, ends, tuple(joints), tuple(notes))


def _window(mechanism: Mechanism, run: Runs, piece: JointMotion, rows: slice) -> tuple[np.ndarray, tuple[str, ...]]:
    """Positions (n, joints) of one run, and why it was given up."""
    from fmu_models.simulation.signal import Signal

    time = piece.time[rows] - piece.time[rows][0]
    start = {}
    for joint, q in enumerate(mechanism.coordinates):
        start |= {q.name: float(piece.position[rows][0, joint]), q.v.name: float(piece.velocity[rows][0, joint])}
    inputs = {
        drive.name: Signal(time, piece.effort[rows][:, joint]) for joint, drive in enumerate(effort_inputs(mechanism))
    }
    try:
        result = run(float(time[-1]), start=start, inputs=inputs, output_times=time)
    except StickslipError as error:
        return np.full((len(time), len(start) // 2), np.nan), (f"From {piece.time[rows][0]:.3g} s: {error}",)
    return np.stack([result[q.name] for q in mechanism.coordinates], axis=1), ()
