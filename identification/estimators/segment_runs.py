"""Segments of logs as initial-value problems: their starts, and runs of the model over them."""

from __future__ import annotations

import weakref
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.sensitivity import SensitiveRun
from fmu_models.simulation.signal import Signal
from identification.disturbances.term import DisturbanceTerm
from identification.laws.joint_law import JointLaw, laws_of
from identification.laws.law import FittableLaw
from identification.measurement.motion import WANDERS
from identification.measurement.pooled import SPEED, rig_values

STARTS = ("theta", "omega")
WAVES = 12  # half waves in a segment that stand for what is left of a drift
Moves = dict[str, dict[str, float]]


@dataclass(frozen=True, eq=False)
class ShootingSegment:
    """One initial-value problem.

    time: (n,) s, ascending; measured: (n,) m (rad where the log states angles); cluster: (n,) labels; deviation: sd of
    the noise, as measured; log: number of the log; drives: rad/s, of each disc in contact; sign: direction of the slip
    on the first of them at the start; laser: whether a laser measured; guess: (2,) angle and speed at ``start_time``,
    rad, rad/s; bristles: m, their deflection there (LuGre), of which an error is forgotten within 0.1 mm of slip;
    lines: (n,) numbers of the encoder's lines where samples are its edges; memory: s, of the noise (0: white); wander:
    deviation of what is left of a drift, as measured.
    """

    start_time: float
    time: np.ndarray
    measured: np.ndarray
    cluster: np.ndarray
    deviation: float
    log: int
    drives: tuple[Signal, ...]
    sign: int
    laser: bool
    guess: np.ndarray
    bristles: float = 0.0
    lines: np.ndarray | None = None
    memory: float = 0.0
    wander: float = 0.0

    def whitened(self, rows: np.ndarray) -> np.ndarray:
        """Rows (n, m) over the deviation of the noise, less what the noise has kept from the sample before."""
        if self.wander:
            slow, shrunk = self._slow
            return rows / self.deviation - slow @ (shrunk * (slow.T @ rows / self.deviation))
        if not self.memory:
            return rows / self.deviation
        # samples that a bootstrap has drawn twice have the same one before
        before = np.searchsorted(self.time, self.time) - 1
        carried = np.where(before < 0, 0.0, np.exp((self.time[before] - self.time) / self.memory))
        share = self.deviation * np.sqrt(1 - carried**2)
        return (rows - carried[:, None] * rows[before]) / share[:, None]

    @cached_property
    def _slow(self) -> tuple[np.ndarray, np.ndarray]:
        """Axes (n, WAVES) of what is left of a drift, with a memory of `WANDERS`, and by which share (WAVES, 1) rows
        shrink along them."""
        orders, lasts = np.arange(WAVES), float(self.time[-1] - self.time[0])
        power = np.where(orders, 4.0, 2.0) * WANDERS / lasts / (1 + (orders * np.pi * WANDERS / lasts) ** 2)
        waves = np.cos(np.pi * np.multiply.outer((self.time - self.time[0]) / lasts, orders)) * np.sqrt(power)
        axes, size, _ = np.linalg.svd(self.wander / self.deviation * waves, full_matrices=False)
        return axes, 1 - 1 / np.sqrt(1 + size[:, None] ** 2)

    def of(self, clusters: np.ndarray) -> ShootingSegment | None:
        """The samples of these clusters (k,), labelled anew by their place among them; None if it has none."""
        rows = [np.flatnonzero(self.cluster == label) for label in clusters]
        labels = np.repeat(np.arange(len(clusters)), [len(row) for row in rows])
        chosen = np.concatenate(rows)
        if not len(chosen):
            return None
        order = np.argsort(self.time[chosen], kind="stable")
        chosen = chosen[order]
        lines = None if self.lines is None else self.lines[chosen]
        return replace(self, time=self.time[chosen], measured=self.measured[chosen], cluster=labels[order], lines=lines)


@dataclass(eq=False)
class Start:
    """Best start states of a segment: states (2,) at x, and how they follow it, slope (2, m)."""

    states: np.ndarray
    x: np.ndarray | None = None
    slope: np.ndarray | None = None

    def at(self, x: np.ndarray) -> np.ndarray:
        """The start states at another x (m,), to first order."""
        return self.states if self.x is None or self.slope is None else self.states + self.slope @ (x - self.x)


class Runs:
    """Kept instances of an FMU, one for each thread that runs it, opened when first needed; another process opens its
    own."""

    def __init__(self, fmu: Fmu, by: Sequence[str]) -> None:
        self.fmu, self.by = fmu, tuple(by)
        self._idle: deque[SensitiveRun] = deque()

    def __reduce__(self) -> tuple[object, ...]:
        return Runs, (self.fmu, self.by)

    @contextmanager
    def taken(self) -> Iterator[SensitiveRun]:
        """An instance that no other thread has."""
        from fmu_models.simulation.sensitivity import SensitiveRun

        try:
            run = self._idle.pop()
        except IndexError:
            run = SensitiveRun(self.fmu, by=self.by, recorded=STARTS)
            weakref.finalize(self, run.close)
        yield run
        self._idle.append(run)


def directions(
    law: FittableLaw, names: Sequence[str], contacts: Sequence[str], terms: Sequence[DisturbanceTerm] = ()
) -> tuple[str, ...]:
    """Parameters of the FMU that the named unknowns move, and the start states: what a run is differentiated by."""
    moved: dict[str, tuple[str, ...]] = {"k/J": ("k",), "c/J": ("c",), "J": ("J", "k", "c")}
    moved |= {constant: (constant,) for constant in ("k", "c", "R", "r")}
    moved |= {name: ("r",) for name in names if name.startswith(SPEED)}
    for single in laws_of(law, contacts):
        moved |= {f"{name}{single.suffix}": (f"{name}{single.disc}",) for name in ("N", *single.law.names)}
    if isinstance(law, JointLaw) and law.changeover is not None and len(contacts) == 2:
        moved[law.changeover] = (law.changeover,)
    moved |= {term.name: (term.parameter,) for term in terms if not term.of_sensor}
    # what the laser alone has, or the disc that is away, moves nothing
    return (*dict.fromkeys(parameter for name in names for parameter in moved.get(name, ())), *STARTS)


def chain(
    law: FittableLaw,
    constants: Mapping[str, float],
    names: Sequence[str],
    parameters: Sequence[str],
    contacts: Sequence[str],
    moved: Mapping[str, Mapping[str, float]] = MappingProxyType({}),
) -> np.ndarray:
    """Derivatives (len(parameters), len(names)) of the FMU's parameters by what the names stand for. moved: by
    disturbances."""
    rig = rig_values(dict(constants))
    by: dict[str, Mapping[str, float]] = {constant: {constant: 1.0} for constant in ("k", "c", "R", "r")}
    by["J"] = {"J": 1.0} | {letter: constants[f"{letter}/J"] for letter in ("k", "c") if f"{letter}/J" in constants}
    by |= moved
    by |= {f"{letter}/J": {letter: rig.J} for letter in ("k", "c")}
    for single in laws_of(law, contacts):
        by |= {f"{name}{single.suffix}": {f"{name}{single.disc}": 1.0} for name in ("N", *single.law.names)}
    if isinstance(law, JointLaw) and law.changeover is not None:
        by[law.changeover] = {law.changeover: 1.0}
    return np.array([[by.get(name, {}).get(parameter, 0.0) for name in names] for parameter in parameters]).reshape(
        len(parameters), len(names)
    )
