"""Friction of a joint that remembers its way: presliding of bearings and gears, by the laws of loops.

    effort = columns of what is no friction + F(x(t), x'(t), z(t); q),    z(0) = share z_full(q)

x position of the joint, which inverse dynamics knows: F and its derivatives by q and z(0) are those of a run of the law
along this way, with every event of it. What the joint remembers at the begin of a piece nobody knows: a share of its
largest states, -1 to 1, is sought beside q, known beforehand as 0 give or take 1.

A search begins at sliders found by a convex fit beside the columns. What a stiffness k takes off rigid friction is
proportional to 1/k: where that is nil within two deviations, or the joint gives way within a step of its encoder, k is
not determined.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.load import load as load_fmu
from fmu_models.language.quantities import Parameter
from fmu_models.simulation.signal import Signal
from identification.calibration.subject import OwnSubject, Stretch, Window
from identification.hysteresis.laws import FORCE, LAWS, WAY, LoopLaw, loop_model
from identification.hysteresis.loop import LoopLog, stops
from identification.hysteresis.spectrum import SLIDERS, SliderSpectrum, non_negative
from identification.inference.choice import coloured_covariance
from identification.inference.problem import Prior, Solution, Unknown, determines, information
from identification.machines.motion import JointMotion, MachineLog
from identification.machines.problem import Friction, MachineProblem, load_of
from identification.machines.rows import Rows

LONGEST = 20  # of the range of the way: presliding is shorter
FINER = 10.0  # than the usual way between samples: the least that is looked for
STIFFER = 3.0  # than that: end of a search
WIDE = 1e3  # times its first value: bounds of a positive parameter
KEPT = 4  # evaluations
SEARCH: Mapping[str, Any] = {"tolerance": 1e-8, "evaluations": 60}  # of a law along its way
SEEN = 2.0  # deviations of a compliance that is there
BACK = 1e-3  # of its range: a joint that goes back by less never reverses
STIFFNESS = "N/m"


def memory_laws() -> tuple[str, ...]:
    """Names of laws with memory that joints may have: those whose search needs no guesses."""
    return tuple(name for name, law in LAWS.items() if law.guesses == 1)


@dataclass(frozen=True, eq=False)
class JointMemory(Friction):
    """A law with memory of one joint. parameters: of the law; own: these, then shares; resolution: rad or m, of the
    encoder; first: where a search begins."""

    law: LoopLaw
    parameters: tuple[Parameter, ...]
    own: tuple[Unknown, ...]
    pieces: Sequence[JointMotion]
    joint: int
    resolution: float
    first: np.ndarray
    _kept: dict[bytes, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict, repr=False)

    @cached_property
    def _subject(self) -> OwnSubject:
        return OwnSubject(load_fmu(loop_model(self.law, rate=False)), [p.name for p in self.parameters], [FORCE])

    @cached_property
    def _full(self) -> Callable[..., tuple[list[float], list[list[float]]]]:
        """Largest states (s,) and their derivatives (s, m) by the parameters."""
        full = [sympy.sympify(state) for state in self.law.law.lowered.full]
        slopes = [[z.diff(p) for p in self.parameters] for z in full]
        return sympy.lambdify(self.parameters, [full, slopes])

    @cached_property
    def _windows(self) -> list[Window]:
        """Of each piece, up to where it moves for the last time."""
        windows = []
        for piece in self.pieces:
            knots, way = _followed(piece.time - piece.time[0], piece.position[:, self.joint])
            time = piece.time - piece.time[0]
            windows.append(Window(0.0, time[time <= knots[-1]], {WAY: Signal(knots, way)}))
        return windows

    def __call__(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As in `Friction`; folds and clusters ask for the same again."""
        key = q.tobytes()
        if key not in self._kept:
            if len(self._kept) >= KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = super().__call__(q)
        return self._kept[key]

    def along(self, q: np.ndarray) -> Iterator[np.ndarray]:
        subject, count = self._subject, len(self.parameters)
        values = dict(zip(subject.parameters, q[:count].tolist(), strict=True))
        full, by_parameters = (np.array(part, dtype=float) for part in self._full(*q[:count]))
        states = [subject.by.index(name) for name in subject.states if not name.startswith("rest")][: len(full)]
        column = subject.recorded.index(FORCE)
        for number, (piece, window) in enumerate(zip(self.pieces, self._windows, strict=True)):
            mine = slice(count + number * len(full), count + (number + 1) * len(full))
            start_states = dict.fromkeys(subject.states, 0.0)
            start_states |= {subject.by[i]: z for i, z in zip(states, (q[mine] * full).tolist(), strict=True)}
            run = subject.respond(Stretch(window, values, start_states))
            by = run.slopes[:, column]
            response = np.zeros((len(piece.time), 1 + len(q)))
            end = len(window.times)
            response[:end, 0] = run.values[:, column]
            response[:end, 1 : 1 + count] = by[:, :count] + by[:, states] @ (q[mine, None] * by_parameters)
            response[:end, 1 + mine.start : 1 + mine.stop] = by[:, states] * full
            response[end:] = response[end - 1]
            yield response

    def start(self, rows: Rows, chosen: np.ndarray) -> np.ndarray:
        """Where sliders found the law, and columns that are left by its friction."""
        columns, effort = rows.weighted
        first = np.concatenate([self.first, np.zeros(int(self.warms))])
        force, _ = self(first)
        x = np.linalg.lstsq(columns, effort - force[chosen] * rows.weight, rcond=None)[0]
        return np.concatenate([x, first])

    def warnings(self, problem: MachineProblem, solution: Solution) -> tuple[str, ...]:
        """Why the stiffness is not known, and parameters of no sense."""
        before = len(problem.unknowns) - len(self.unknowns)
        q = solution.values[before : before + len(self.parameters)]
        stiff = np.array([p.unit == STIFFNESS for p in self.parameters])
        total, full = float(q[stiff].sum()), np.array(self._full(*q)[0], dtype=float)
        length = float(q[stiff] @ full) / total if len(full) == stiff.sum() else float(full.mean())
        if any(at for at, stiffness in zip(solution.at_bound[before:], stiff, strict=False) if stiffness):
            least, why = total, "a stiffer one gives way between two samples"
        elif length < self.resolution:
            least = total * length / self.resolution
            why = f"it gives way within a step of its encoder, {self.resolution:.2g}"
        elif not determines(information(problem, solution.evaluation)):
            return ("The logs do not tell its parameters apart.",)
        else:
            covariance = coloured_covariance(problem, solution, "hac")[before:, before:][: len(q), : len(q)]
            share = float(np.sqrt(stiff @ covariance @ stiff)) / total
            if SEEN * share < 1:
                return ()
            least, why = total / (1 + SEEN * share), "rigid friction tells the same"
        unit = self.unknowns[int(np.argmax(stiff))].unit
        return (f"Its stiffness is not determined: it is larger than {least:.2g} {unit}, for {why}.",)


def _followed(time: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Knots of a way: its samples, and its turns between them, without which friction would turn half a sample late. A
    joint that stands has no sense: its way is drawn from where it came to to where it goes on."""
    moving = np.concatenate([[0], np.flatnonzero(np.diff(way)) + 1])
    speed = np.gradient(way, time)
    turns = np.flatnonzero(speed[:-1] * speed[1:] < 0)
    before, after = speed[turns], speed[turns + 1]
    late = before / (before - after) * (time[turns + 1] - time[turns])
    extreme, ends = way[turns] + before * late / 2, (way[turns], way[turns + 1])
    extreme = np.where(before > 0, np.maximum(extreme, np.maximum(*ends)), np.minimum(extreme, np.minimum(*ends)))
    knots, first = np.unique(np.concatenate([time[moving], time[turns] + late]), return_index=True)
    drawn = np.concatenate([way[moving], extreme])[first]
    within = knots <= time[moving[-1]]
    return knots[within], drawn[within]


def resolution_of(logs: Sequence[MachineLog], joint: int) -> float:
    """Step of an encoder, rad or m: the least by which the position changes; nearly nothing where it shows none."""
    steps = np.concatenate([np.abs(np.diff(log.position[:, joint])) for log in logs])
    return float(np.min(steps[steps > 1e-9 * np.max(steps)], initial=np.inf)) if np.max(steps) > 0 else 0.0


def presliding(
    rows: Rows, pieces: Sequence[JointMotion], joint: int, resolution: float
) -> tuple[SliderSpectrum, float]:
    """Sliders of a joint beside columns of what is no friction and viscous friction, and what they leave of the effort,
    root mean square. rows: of the joint; resolution: rad or m, of its encoder. StickslipError: no position, a joint
    that never reverses, nothing that slides."""
    ways, speeds = ([getattr(piece, name)[:, joint] for piece in pieces] for name in ("position", "velocity"))
    span = max(float(np.ptp(way)) for way in ways)
    if not span > 0:
        raise StickslipError("The logs hold no position of it, without which nothing can be remembered.")
    steps = np.concatenate([np.diff(way) for way in ways])
    if min(steps[steps > 0].sum(), -steps[steps < 0].sum()) < BACK * span:
        raise StickslipError("It never reverses in these logs: they tell nothing of a stiffness.")
    least = max(resolution, float(np.sqrt(np.mean(steps**2))) / FINER)
    bound = np.geomspace(min(least, span / LONGEST / 2), span / LONGEST, SLIDERS)

    def thinned(parts: Sequence[np.ndarray]) -> np.ndarray:
        shown = [piece.thinned(part * load_of(piece)) for piece, part in zip(pieces, parts, strict=True)]
        return np.concatenate(shown)[rows.used]

    weight = rows.weight[rows.used, None]
    columns = weight * thinned([stops(LoopLog("", way, way), bound) for way in ways])
    free, effort = rows.where(rows.used).weighted
    free = np.column_stack([free, weight * thinned([speed[:, None] for speed in speeds])])
    weights = non_negative(columns, free, effort)
    residual = effort - np.column_stack([columns, free]) @ weights
    spectrum = SliderSpectrum(
        bound=bound,
        stiffness=weights[:SLIDERS, None],
        reach=span / 2,
        factors=(),
        widths=np.array([max(float(np.abs(speed).max()) for speed in speeds)]),
        damping=np.zeros((1, 1)),
        viscous=weights[-1:],
        spring=0.0,
        offset=0.0,
        rate=True,
        loaded=False,
    )
    if spectrum.sliding_force() <= 0:
        raise StickslipError("Nothing of it slides in these logs.")
    return spectrum, float(np.sqrt(np.mean(residual**2)))


def joint_memory(
    name: str, spectrum: SliderSpectrum, pieces: Sequence[JointMotion], joint: int, resolution: float, *, turning: bool
) -> JointMemory:
    """A law of a joint that begins at its sliders. turning: rad and N m in place of m and N; the rest as in
    `presliding`."""
    law = LAWS[name]
    first, limits = law.first(spectrum), law.bounds(spectrum)
    parameters = tuple(p for p in loop_model(law, rate=False).parameters if p.name in first)
    # stiffer than its samples can tell a law is rigid, and its runs are long
    stiff = sum(first[p.name] for p in parameters if p.unit == STIFFNESS)
    room = spectrum.sliding_force() / (spectrum.bound[0] / STIFFER) / stiff

    def unknown(p: Parameter) -> Unknown:
        wide = (first[p.name] / WIDE, first[p.name] * WIDE) if p.positive else (p.minimum or 0.0, np.inf)
        low, high = limits.get(p.name, wide)
        power = {STIFFNESS: 1, "1/m": 1, "1/m2": 2}.get(p.unit)
        if power:
            high = min(high, first[p.name] * room**power)
        if p.unit == "m":
            low = spectrum.bound[0] / STIFFER
        unit = p.unit.replace("m", "rad").replace("N", "N m") if turning else p.unit
        return Unknown(p.name, unit, low, high, p.description)

    shares = [
        Unknown(label, "1", -1.0, 1.0, "of its memory at the begin", Prior(label, 0.0, "1", 1.0, "any", many=True))
        for piece in range(1, len(pieces) + 1)
        for number in range(1, len(law.law.lowered.full) + 1)
        for label in (f"z{number}_{piece}",)
    ]
    start_values = np.array([*(first[p.name] for p in parameters), *(0.0 for _ in shares)])
    return JointMemory(law, parameters, (*map(unknown, parameters), *shares), pieces, joint, resolution, start_values)
