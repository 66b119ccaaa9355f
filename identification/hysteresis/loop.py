"""A log of force against displacement, and the branches between the turns of its way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from fmu_models.base.shown import Tabular

NOISY = 3e-4  # of the range of the way: noise above it takes stiffness from a fit
SMOOTHED = 12  # windows of the smoothing in a cycle
FINE = 6  # samples in such a window, or there is nothing to smooth over
REVERSAL = 0.05  # of the range of the way: a turn that opens a cycle


@dataclass(frozen=True, eq=False)
class LoopLog(Tabular):
    """Force against displacement.

    Attributes:
        name: of the log.
        way: (n,) displacement, m.
        force: (n,) N, with the sign that resists the way.
        time: (n,) s, None where the log has none: then nothing in it depends on the rate.
        load: (n,) factor of the force, such as a normal force in N, None where it is constant.
        conditions: what was the same all through it, such as a current, by name.
        signals: (n,) what was not, such as a voltage, by name, in units of its own.
        turned: whether it begins at a far turn, where all sliders that ever slide do; else at rest, without memory.
        known: whether that is so; where nobody knows it, laws seek how they begin, and sliders take it as at rest.
        notes: what was done to it and what it lacks.
        checked: whether `read.checked` has seen it as it is; a copy with other values is not.
    """

    COLUMNS = ("way", "force")

    name: str
    way: np.ndarray
    force: np.ndarray
    time: np.ndarray | None = None
    load: np.ndarray | None = None
    conditions: Mapping[str, float] = field(default_factory=dict)
    signals: Mapping[str, np.ndarray] = field(default_factory=dict)
    turned: bool = False
    known: bool = True
    notes: tuple[str, ...] = ()
    checked: bool = field(default=False, init=False)

    @property
    def range(self) -> float:
        """Of the way, m."""
        return float(np.ptp(self.way))

    @property
    def center(self) -> float:
        """Middle of the range of the way, m."""
        return float(self.way.max() + self.way.min()) / 2

    @cached_property
    def turns(self) -> np.ndarray:
        """Samples (k,) at which the way turns, the first and the last included."""
        sense = np.sign(np.diff(self.way))
        moving = np.flatnonzero(sense)
        changes = moving[1:][sense[moving[1:]] != sense[moving[:-1]]]
        return np.concatenate([[0], changes, [len(self.way) - 1]]).astype(int)

    @cached_property
    def reversals(self) -> np.ndarray:
        """Samples (k,) of the turns that open a cycle: the way goes back by `REVERSAL` of its range."""
        least, indices = REVERSAL * self.range, [0]
        sense, extreme = 0, 0
        for turn in self.turns[1:]:
            step = self.way[turn] - self.way[extreme]
            if sense == 0 or sense * step >= 0:
                extreme = int(turn)
                sense = sense or int(np.sign(step))
            elif abs(step) > least:
                indices.append(extreme)
                extreme, sense = int(turn), -sense
        return np.array([*indices, len(self.way) - 1])

    @property
    def samples_per_cycle(self) -> float:
        """About; all of them where the way does not turn."""
        return 2 * len(self.way) / max(len(self.reversals) - 1, 1)

    @property
    def work(self) -> float:
        """That the force takes over the whole log, J: positive where it resists."""
        return float(np.trapezoid(self.force, self.way))

    @property
    def noise(self) -> float:
        """Standard deviation of what neighbours in the way do not share, m."""
        return scatter(self.way)

    def smooth(self) -> LoopLog:
        """The log with a way free of noise, by parabolas over a twelfth of a cycle; itself where nothing is gained."""
        window = int(self.samples_per_cycle) // SMOOTHED // 2 * 2 + 1
        if self.noise < NOISY * self.range or window < FINE:
            return self
        from scipy.signal import savgol_filter

        note = (
            f"The way of {self.name} is noisy by {100 * self.noise / self.range:.2g} % of its range, which would take "
            f"from the stiffness: it was smoothed over {window} samples."
        )
        return replace(self, way=savgol_filter(self.way, window, 2), notes=(*self.notes, note))

    def speed(self) -> np.ndarray:
        """(n,) m/s, by parabolas over a twelfth of a cycle; of a log with time."""
        from scipy.signal import savgol_filter

        assert self.time is not None
        window = max(int(self.samples_per_cycle) // (2 * SMOOTHED) // 2 * 2 + 1, 5)
        step = float(np.median(np.diff(self.time)))
        window = min(window, len(self.way) // 2 * 2 - 1)
        return np.asarray(savgol_filter(self.way, window, 2, deriv=1, delta=step))

    def from_largest(self) -> LoopLog:
        """The log from its largest excursion on, where every slider that ever slides does: before it nobody knows what
        the material remembers. Itself if it begins without force."""
        center, reach = self.center, self.range / 2
        begins_free = abs(self.force[0] - np.median(self.force)) < 0.1 * np.ptp(self.force)
        begins_free = begins_free and abs(self.way[0] - center) < 0.2 * reach
        extremes = self.reversals[np.abs(self.way[self.reversals] - center) > 0.95 * reach]
        if begins_free:
            return self
        if len(extremes) and extremes[0] == 0:
            # pulled as far as it goes, or mounted there and pulled to one side
            away = np.abs(self.force - np.median(self.force))
            return replace(self, turned=bool(away[0] > 0.5 * away.max()))
        if not len(extremes) or extremes[0] > len(self.way) // 2:
            note = f"{self.name} begins with a memory that nobody knows and turns late: sliders take it as at rest."
            return replace(self, known=False, notes=(*self.notes, note))
        first = int(extremes[0])
        note = f"{self.name} begins with a memory that nobody knows: {first} samples up to its first far turn are left."
        return replace(self.part(first, None), turned=True, notes=(*self.notes, note))

    def part(self, first: int, last: int | None, stride: int = 1) -> LoopLog:
        """Samples from ``first`` to before ``last``, one of ``stride``."""
        columns = {name: getattr(self, name) for name in ("way", "force", "time", "load")}
        chosen = slice(first, last, stride)
        signals = {name: values[chosen] for name, values in self.signals.items()}
        return replace(self, signals=signals, **{k: None if v is None else v[chosen] for k, v in columns.items()})

    def lagged(self, lag: float) -> LoopLog:
        """The log with signals u that follow what was recorded, v, by lag u' = v - u, from rest; lag: s. Exact for
        straight lines between samples."""
        if lag <= 0 or self.time is None:
            return self
        steps = np.diff(self.time) / lag
        stays = np.exp(-steps)
        return replace(self, signals={name: _following(v, steps, stays) for name, v in self.signals.items()})


def _following(values: np.ndarray, steps: np.ndarray, stays: np.ndarray) -> np.ndarray:
    """(n,) what follows values (n,) by a lag that is the unit of ``steps`` (n - 1,)."""
    behind = values[1:] - np.diff(values) / steps  # of a ramp that has lasted
    before = values[:-1] - np.diff(values) / steps
    followed = [float(values[0])]
    for start, end, stay in zip(before.tolist(), behind.tolist(), stays.tolist(), strict=True):
        followed.append(end + (followed[-1] - start) * stay)
    return np.array(followed)


def scatter(values: np.ndarray) -> float:
    """Standard deviation of what neighbours in values (n,) do not share: by third differences, robust."""
    third = np.diff(values, 3)
    return 1.4826 * float(np.median(np.abs(third - np.median(third)))) / np.sqrt(20) if len(third) else 0.0


def stops(log: LoopLog, bound: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
    """Elongations (n, k), m, of springs behind sliders that give way at ``bound`` (k,), from ``start`` (k,)."""
    z = np.zeros((len(log.way), len(bound)))
    z[0] = 0.0 if start is None else np.clip(start, -bound, bound)
    for first, last in pairwise(log.turns):
        steps = log.way[first + 1 : last + 1] - log.way[first]
        z[first + 1 : last + 1] = np.clip(z[first] + steps[:, None], -bound, bound)
    return z


def saturated(log: LoopLog, bound: np.ndarray) -> np.ndarray:
    """Elongations (k,), m, at the begin of a log: at their bounds, as far as the range lets them, of one that begins at
    a far turn; else 0."""
    if not log.turned:
        return np.zeros(len(bound))
    return np.sign(log.way[0] - log.center) * np.minimum(bound, log.range / 2)
