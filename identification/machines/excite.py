"""Motion that shows the base parameters of a machine best, within limits of positions, velocities and efforts.

    q_j(t) = middle_j + s sum_h (a_jh sin h w t + b_jh cos h w t),    maximise ln det(Y'Y) over a, b

at equal noise of all efforts; s is as large as the limits allow. ln det does not depend on units. Efforts are those of
the declared values.

Sources: Swevers, Ganseman, Tukel, De Schutter, Van Brussel (1997), IEEE Trans. Robotics Automation 13, 730 (Fourier
series); Pukelsheim (2006), Optimal Design of Experiments (determinants).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.record import Recorded
from fmu_models.base.shown import Tabular
from fmu_models.language.mechanism import Mechanism
from identification.inference.excitation import best_of_draws, fourier
from identification.machines.regressor import Regressor, base_parameters, effort_inputs, regressor_of

if TYPE_CHECKING:
    import pandas

GRID = 128  # times in a period where the columns are asked
FINE = 1024  # where limits are
EVALUATIONS = 1500  # of each search
NOISE = 0.01  # of the usual effort, per sample, for the deviations that are foretold


@dataclass(frozen=True)
class Excitation(Tabular, Recorded):
    """Coefficients of a motion (joints, harmonics), its middle (joints,) and period (s). deviations: foretold, by base
    parameter, for efforts sampled at ``rate`` with noise of ``noise`` of the usual effort; condition: of the columns,
    each scaled to one; gain: of ln det over the best of random motions."""

    machine: str
    joints: tuple[str, ...]
    period: float
    middle: tuple[float, ...]
    sines: tuple[tuple[float, ...], ...]
    cosines: tuple[tuple[float, ...], ...]
    rate: float
    noise: float
    condition: float
    gain: float
    deviations: Mapping[str, float]
    units: Mapping[str, str] = field(default_factory=dict)

    def at(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions, velocities and accelerations (n, joints) at times (n,) s."""
        return fourier(np.array(self.middle), np.array(self.sines), np.array(self.cosines), self.period, time)

    @property
    def frame(self) -> pandas.DataFrame:
        """The motion over a period at ``rate``: time, and position, velocity, acceleration of each joint."""
        import pandas

        time = np.arange(round(self.period * self.rate)) / self.rate
        columns = {"time": time}
        for name, values in zip(("", "_velocity", "_acceleration"), self.at(time), strict=True):
            columns |= {f"{joint}{name}": values[:, column] for column, joint in enumerate(self.joints)}
        return pandas.DataFrame(columns)

    def _heading(self) -> str:
        return f"Excitation of {self.machine}: {self.period:g} s, condition {self.condition:.3g}"

    def _contents(self) -> Mapping[str, Any]:
        return {name: f"+- {sd:.2g} {self.units.get(name, '')}" for name, sd in self.deviations.items()}


def excite(
    mechanism: Mechanism,
    limits: Mapping[str, tuple[float, float]],
    *,
    known: Mapping[str, float] | None = None,
    period: float = 10.0,
    harmonics: int = 5,
    rate: float = 250.0,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Excitation:
    """Design a motion. limits: low and high by name of a coordinate (all of them needed), of its velocity or of an
    effort; known: as in `identify_machine`; harmonics: of the period (s); rate: Hz, of the samples to come.
    StickslipError: a limit is missing, of no quantity, or leaves nothing."""
    if not (period > 0 and rate > 0 and harmonics >= 1):
        raise StickslipError("Period, rate and the number of harmonics must be above 0.")
    regressor = regressor_of(mechanism, known)
    room = _Room(mechanism, regressor, limits)
    design = _Design(regressor, base_parameters(regressor).places, room, period, harmonics)
    optimum, first = best_of_draws(design.cost, design.draw, seed, EVALUATIONS, progress or (lambda _: None))
    base = base_parameters(regressor)
    columns, efforts = design.columns(optimum)
    noise = NOISE * float(np.sqrt(np.mean(efforts**2)))
    count = period * rate / GRID
    spread = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns * count))) * noise
    middle, sines, cosines = design.coefficients(optimum)
    return Excitation(
        mechanism.name,
        regressor.joints,
        period,
        tuple(middle.tolist()),
        tuple(tuple(row) for row in sines.tolist()),
        tuple(tuple(row) for row in cosines.tolist()),
        rate,
        NOISE,
        float(np.linalg.cond(columns / np.linalg.norm(columns, axis=0))),
        design.cost(first) - design.cost(optimum),
        dict(zip(base.names, spread.tolist(), strict=True)),
        {parameter.name: parameter.unit for parameter in base.parameters},
    )


class _Room:
    """What the limits allow: ranges (joints, 2) of positions, velocities and efforts."""

    def __init__(self, mechanism: Mechanism, regressor: Regressor, limits: Mapping[str, tuple[float, float]]) -> None:
        self.regressor = regressor
        names = [
            [q.name for q in mechanism.coordinates],
            [q.v.name for q in mechanism.coordinates],
            [effort_input.name for effort_input in effort_inputs(mechanism)],
        ]
        quantities = [name for group in names for name in group]
        for name, (low, high) in limits.items():
            refuse_unknown(name, quantities, f"{mechanism.name} has no coordinate, velocity or effort '{name}'.")
            if not low < high:
                raise StickslipError(f"The limits of '{name}', {low:g} to {high:g}, leave nothing.")
            if name not in names[0] and not low < 0 < high:
                raise StickslipError(f"The limits of '{name}', {low:g} to {high:g}, must hold 0.")
        missing = [name for name in names[0] if name not in limits]
        if missing:
            raise StickslipError(f"Give limits of {', '.join(missing)}: --limit {missing[0]}=-1:1.")
        everything = (-np.inf, np.inf)
        self.position, self.velocity, self.effort = (
            np.array([limits.get(name, everything) for name in group], dtype=float) for group in names
        )

    @property
    def middle(self) -> np.ndarray:
        """Middle of the position range (joints,)."""
        return self.position.mean(axis=1)

    def share(self, q: np.ndarray, v: np.ndarray) -> float:
        """Share of a swing about the middle that stays within the ranges of positions and velocities."""
        reach = np.max(np.abs(q - self.middle), axis=0) / (np.ptp(self.position, axis=1) / 2)
        fast = np.max(np.maximum(v / self.velocity[:, 1], v / self.velocity[:, 0]), axis=0)
        return float(1 / max(np.max(reach), np.max(fast), 1e-12))

    def holds(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> bool:
        """Whether the efforts by the declared values stay within their range."""
        if not np.isfinite(self.effort).any():
            return True
        tau = self.regressor(q, v, a) @ self.regressor.declared
        return bool(np.all(tau >= self.effort[:, 0]) and np.all(tau <= self.effort[:, 1]))


class _Design:
    """The search for the best motion."""

    def __init__(self, regressor: Regressor, places: list[int], room: _Room, period: float, harmonics: int) -> None:
        self.regressor, self.places, self.room, self.period = regressor, places, room, period
        self.shape = (2, len(regressor.joints), harmonics)
        self.grid, self.fine = np.arange(GRID) * period / GRID, np.arange(FINE) * period / FINE

    def coefficients(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Middle, sines and cosines of the search variables (2 joints harmonics,), as large as the limits allow."""
        sines, cosines = x.reshape(self.shape)
        middle = self.room.middle
        q, v, _ = fourier(middle, sines, cosines, self.period, self.fine)
        share = self.room.share(q, v)
        for _ in range(40):
            if self.room.holds(*fourier(middle, share * sines, share * cosines, self.period, self.fine)):
                return middle, share * sines, share * cosines
            share *= 0.9
        raise StickslipError(
            "Even the least motion takes efforts beyond their limits: the weight does at the middle of the positions. "
            "Widen them, or choose other positions."
        )

    def columns(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Columns of the base parameters over a period (GRID joints, b), and the declared efforts."""
        q, v, a = fourier(*self.coefficients(x), self.period, self.grid)
        regressor = self.regressor(q, v, a)
        return regressor[:, :, self.places].reshape(-1, len(self.places)), regressor @ self.regressor.declared

    def cost(self, x: np.ndarray) -> float:
        """- ln det of the information."""
        columns, _ = self.columns(x)
        sign, value = np.linalg.slogdet(columns.T @ columns)
        return -float(value) if sign > 0 else 1e6

    def draw(self, random: np.random.Generator) -> np.ndarray:
        """Search variables of a random motion."""
        return (random.normal(size=self.shape) / np.arange(1, self.shape[2] + 1)).ravel()
