"""What logs say of a declared machine: base parameters, how sure, how well they predict, and what to think of them."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.files import existing
from fmu_models.base.shown import Tabular
from fmu_models.language.mechanism import Mechanism
from identification.machines.base_parameters import Base, base_parameters
from identification.machines.identify import (
    LOW,
    METHODS,
    Solved,
    rows_of,
    solve_machine,
    together,
    usual_frequency,
    weighted,
)
from identification.machines.motion import Cutoffs, MachineLog, Motion, motions
from identification.machines.regressor import Regressor, regressor_of
from identification.machines.simulated import Stretches, run

if TYPE_CHECKING:
    import pandas

FREE_RUN = 1.0  # s
BIASED = 3.0  # standard deviations between least squares and instruments
UNKNOWN = 0.3  # of its value: a deviation that leaves a parameter open
OPEN = 300.0  # condition of the columns: logs of good motion have 5 to 100
ROUGH = 0.1  # of its value: a deviation of friction that a lower cutoff would mend
POOR = 0.5  # of the effort: a residual that says the model or the log is wrong


@dataclass(frozen=True)
class MachineParameter:
    """A base parameter. combination: what it stands for; standard_deviation: the larger of Newey-West's and the
    jackknife's over logs; least_squares: value by that, with its own deviation; shift: from there to ``value``, in
    deviations (0 where least squares was asked for)."""

    name: str
    combination: str
    value: float
    unit: str
    standard_deviation: float
    least_squares: float
    least_squares_deviation: float
    shift: float
    frictional: bool


@dataclass(frozen=True)
class JointScore:
    """How well one joint's effort is predicted, |residual|/|effort|: on the logs of the fit, on each of these left out,
    on logs that were held out; free_run: of its position over 1 s from the measured state by the measured efforts, rms
    error over the standard deviation of its motion, None where the simulation leaves the logs."""

    joint: str
    unit: str
    seen: float
    left_out: float | None
    held_out: float | None
    free_run: float | None


@dataclass(frozen=True)
class MachineFit(Tabular):
    """Base parameters of a machine. known: parameters that were taken as given; open: monomials that no effort shows;
    condition: of the weighted columns, each scaled to one; rounds: of instruments; verdicts: in words; declaration:
    where the machine is declared (empty: nowhere but in the program), read with ``gravity`` (m/s^2; empty: its own);
    columns: of its logs by name of a coordinate or effort, where they differ."""

    machine: str
    title: str
    method: str
    joints: tuple[JointScore, ...]
    parameters: tuple[MachineParameter, ...]
    known: Mapping[str, float]
    silent: tuple[str, ...]
    cutoff: float
    parallel_cutoff: float
    logs: tuple[str, ...]
    samples: int
    condition: float
    rounds: int
    verdicts: tuple[str, ...]
    declaration: str = ""
    gravity: tuple[float, ...] = ()
    columns: Mapping[str, str] = dataclasses.field(default_factory=dict)

    @property
    def frame(self) -> pandas.DataFrame:
        """A row for each base parameter."""
        import pandas

        rows = [dataclasses.asdict(one) for one in self.parameters]
        return pandas.DataFrame(rows).set_index("name")

    def __getitem__(self, name: str) -> MachineParameter:
        """A base parameter by the name of the monomial that it is called after.

        Raises:
            StickslipError: there is none.
        """
        for one in self.parameters:
            if one.name == name:
                return one
        names = [one.name for one in self.parameters]
        raise StickslipError(f"{self.machine} has no base parameter '{name}'.{nearest(name, names)}")

    def _heading(self) -> str:
        return f"MachineFit: {self.machine}, {len(self.parameters)} base parameters by {self.method}"

    def _contents(self) -> Mapping[str, Any]:
        return {one.name: f"{one.value:.5g} +- {one.standard_deviation:.2g} {one.unit}" for one in self.parameters}

    def to_dict(self) -> dict[str, Any]:
        """As plain values."""
        return dataclasses.asdict(self)


def is_machine_fit(path: str | os.PathLike[str]) -> bool:
    """Whether a file holds the fit of a machine; a file that cannot be read is left to those who read fits."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(content, dict) and "machine" in content


def read_machine_fit(path: str | os.PathLike[str]) -> MachineFit:
    """A result of 'stickslip inverse MACHINE LOGS -o FILE.json'.

    Raises:
        StickslipError: there is none, or it is something else.
    """
    file = existing(path, "fit", " Make one: stickslip inverse MACHINE LOGS -o FILE.json")
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        taken = {one.name: content[one.name] for one in dataclasses.fields(MachineFit)}
        taken["joints"] = tuple(JointScore(**one) for one in content["joints"])
        taken["parameters"] = tuple(MachineParameter(**one) for one in content["parameters"])
        for name in ("silent", "logs", "verdicts", "gravity"):
            taken[name] = tuple(content[name])
        return MachineFit(**taken)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StickslipError(
            f"'{path}' is no fit of a machine ({error}). Give a result of 'stickslip inverse MACHINE LOGS -o FILE'."
        ) from error


def identify_machine(
    mechanism: Mechanism,
    logs: Sequence[MachineLog],
    *,
    known: Mapping[str, float] | None = None,
    cutoff: float = 10.0,
    parallel_cutoff: float | None = None,
    method: str = METHODS[0],
    held_out: Sequence[MachineLog] = (),
    progress: Callable[[float], None] | None = None,
) -> MachineFit:
    """Base parameters of a declared machine from logs of efforts and positions.

    known: values of parameters that are not to be found, by name; cutoff: Hz, of the low-pass of positions;
    parallel_cutoff: of that over efforts and columns, the same if None; method: "instruments" or "least squares";
    held_out: logs that only score.

    Raises:
        StickslipError: as in `regressor_of`, `motions` and `solve_machine`.
    """
    if method not in METHODS:
        raise StickslipError(f"There is no method '{method}'.{nearest(method, METHODS)}")
    if not logs:
        raise StickslipError("There is no log. Give one, better several.")
    regressor = regressor_of(mechanism, known)
    base = base_parameters(regressor)
    cutoffs = Cutoffs(cutoff, parallel_cutoff or cutoff)
    solved = solve_machine(regressor, base, logs, cutoffs, method=method, progress=progress)
    others = weighted(rows_of(regressor, base, motions(held_out, regressor.joints, cutoffs))) if held_out else None
    joints = tuple(
        JointScore(
            name,
            drive.unit,
            _relative(solved.rows.residual(solved.best.values), solved.rows.effort, solved.rows.joint == place),
            _left_out(solved, place),
            None
            if others is None
            else _relative(others.residual(solved.best.values), others.effort, others.joint == place),
            error,
        )
        for place, (name, drive, error) in enumerate(
            zip(regressor.joints, _inputs(mechanism, regressor), free_run(regressor, base, solved), strict=True)
        )
    )
    parameters = _parameters(base, solved)
    condition, alike = together(base, solved.rows)
    return MachineFit(
        machine=mechanism.name,
        title=mechanism.title,
        method=method,
        joints=joints,
        parameters=parameters,
        known=dict(known or {}),
        silent=base.silent,
        cutoff=cutoffs.kinematic,
        parallel_cutoff=cutoffs.parallel,
        logs=tuple(log.name for log in logs),
        samples=len(solved.rows.effort),
        condition=condition,
        rounds=solved.best.rounds,
        verdicts=(
            *_left_open(condition, alike),
            *_verdicts(mechanism, regressor, base, solved, parameters, joints),
            *(note for log in (*logs, *held_out) for note in log.notes),
        ),
    )


def _inputs(mechanism: Mechanism, regressor: Regressor) -> list[Any]:
    by_name = {one.name: one for one in mechanism.inputs}
    return [by_name[name] for name in regressor.efforts]


def _relative(residual: np.ndarray, effort: np.ndarray, rows: np.ndarray) -> float:
    return float(np.linalg.norm(residual[rows]) / np.linalg.norm(effort[rows]))


def _left_out(solved: Solved, joint: int) -> float | None:
    """Error of one joint over all logs, each predicted by the others; None of a single log."""
    rows, logs = solved.rows, np.unique(solved.rows.log)
    if len(logs) < 2:
        return None
    off = np.empty(len(rows.effort))
    for log in logs:
        mine = rows.log == log
        off[mine] = rows.residual(solved.without(int(log)))[mine]
    return _relative(off, rows.effort, rows.joint == joint)


def _parameters(base: Base, solved: Solved) -> tuple[MachineParameter, ...]:
    best, squares = solved.best, solved.least_squares
    found = []
    for place, one in enumerate(base.parameters):
        deviation = float(best.deviation[place])
        found.append(
            MachineParameter(
                one.name,
                one.combination,
                float(best.values[place]),
                one.unit,
                deviation,
                float(squares.values[place]),
                float(squares.deviation[place]),
                float((best.values[place] - squares.values[place]) / deviation),
                one.frictional,
            )
        )
    return tuple(found)


def free_run(regressor: Regressor, base: Base, solved: Solved) -> list[float | None]:
    """By joint, see `JointScore`: windows one after the other, all at once."""
    pieces = solved.pieces
    values = np.zeros(len(regressor.names))
    values[base.places] = solved.best.values
    length = max(int(FREE_RUN / pieces[0].step), 2)
    windows = [
        (piece, begin)
        for piece in pieces
        for begin in range(piece.kept.start, max(piece.kept.stop - length, piece.kept.start), length)
    ]
    if not windows:
        return [None] * len(regressor.joints)

    def taken(of: Callable[[Motion], np.ndarray]) -> np.ndarray:
        return np.stack([of(piece)[begin : begin + length] for piece, begin in windows])

    measured = taken(lambda one: one.position)
    stretches = Stretches(pieces[0].step, measured, taken(lambda one: one.velocity), taken(lambda one: one.effort))
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            position, _, _ = run(regressor, values, stretches, 0.0)
    except np.linalg.LinAlgError:
        return [None] * len(regressor.joints)
    spread = np.std(np.concatenate([piece.position for piece in pieces]), axis=0)
    errors = np.sqrt(np.mean((position - measured) ** 2, axis=(0, 1))) / spread
    return [float(one) if np.isfinite(one) and one < 10 else None for one in errors]


def _left_open(condition: float, alike: Sequence[str]) -> list[str]:
    if condition < OPEN:
        return []
    return [
        f"The logs hardly tell {', '.join(alike)} apart (condition {condition:.0f}): they show one combination, and "
        "each value rests on noise, more than its deviation says. Record motion at several frequencies and poses "
        "('stickslip excite' designs it), or take one of them as known."
    ]


def _verdicts(
    mechanism: Mechanism,
    regressor: Regressor,
    base: Base,
    solved: Solved,
    parameters: Sequence[MachineParameter],
    joints: Sequence[JointScore],
) -> list[str]:
    said = []
    biased = [one.name for one in parameters if abs(one.shift) > BIASED]
    if biased:
        said.append(
            f"Least squares is biased in {', '.join(biased)} (more than {BIASED:g} deviations from the instruments): "
            "the noise of the positions is in its columns. Take the values by instruments, or lower the cutoff."
        )
    rough = [one.name for one in parameters if one.frictional and one.standard_deviation > ROUGH * abs(one.value)]
    if biased and rough:
        enough = LOW * usual_frequency(solved.pieces)
        said.append(
            f"{', '.join(rough)} rest on the velocity near its turns, where noise of the positions is strongest: they "
            f"scatter more than their deviations say. Lower the cutoff; {enough:.2g} Hz pass the motion of these logs."
        )
    positive = {p.name for p in mechanism.parameters if p.positive or p.minimum == 0}
    for one, spec in zip(parameters, base.parameters, strict=True):
        must = (one.name in positive and all(factor > 0 for _, factor in spec.others)) or (
            one.frictional and not spec.others
        )
        if must and one.value < 0:
            kind = "friction that drives" if one.frictional else "an inertia below zero"
            sure = abs(one.value) > 2 * one.standard_deviation
            said.append(
                f"{one.combination} = {one.value:.4g} {one.unit} is {kind}"
                + (": check signs and units of efforts and positions." if sure else ", within its deviation.")
            )
        elif abs(one.value) < one.standard_deviation / UNKNOWN:
            said.append(
                f"{one.combination} is hardly known: {one.value:.3g} +- {one.standard_deviation:.2g} {one.unit}. "
                "Motion that excites it more would help, or take it as known."
            )
    for one in joints:
        if one.seen > POOR:
            said.append(
                f"The residual of '{one.joint}' is {100 * one.seen:.0f} % of its effort: the model, the signals or the "
                "cutoff is wrong (efforts are noisy above the motion: lower the parallel cutoff)."
            )
        if one.free_run is None:
            said.append(f"Simulated from the measured state, '{one.joint}' leaves the log within {FREE_RUN:g} s.")
    if base.silent:
        said.append(f"No effort shows {', '.join(base.silent)}, whatever the motion.")
    return [*said, *_gravity(regressor, base, solved)]


def _gravity(regressor: Regressor, base: Base, solved: Solved) -> list[str]:
    """Whether the declared gravity is met in size and sign, joint by joint, where the declaration has values for it."""
    rest = np.zeros((1, len(regressor.joints)))
    said = []
    rng = np.random.default_rng(0)
    for place, joint in enumerate(regressor.joints):
        q = rng.uniform(-np.pi, np.pi, (50, len(regressor.joints)))
        standing = regressor(q, np.zeros_like(q) + rest, np.zeros_like(q))[:, place]
        declared = standing @ regressor.declared
        found = standing[:, base.places] @ solved.best.values
        if np.linalg.norm(declared) < 1e-9 * max(np.linalg.norm(found), 1e-12):
            continue
        ratio = float(found @ declared / (declared @ declared))
        if ratio < 0:
            said.append(
                f"The weight on '{joint}' comes out with the other sign: its effort or its position is reversed."
            )
        elif not 0.2 < ratio < 5:
            said.append(
                f"The weight on '{joint}' comes out {ratio:.3g} times the declared one: check the unit of its effort "
                "(N m, on the joint's side of the gear) and of its position (rad)."
            )
    return said
