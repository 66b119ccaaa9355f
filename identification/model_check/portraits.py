"""Phase portraits compared: a measured cycle against a modelled one, both processed alike.

Both motions are smoothed by the same filter, cut into cycles where the angle rises through the middle of its range, and
averaged over cycles at equal phase: a closed mean cycle (angle, speed) with the stick on each disc. Angles and speeds
are scaled by the half ranges of the measured cycle, so that the figures are free of units. Acceptance levels
(prototypes of this project):
    amplitude 3 %, period 1 %, stick fraction 0.02, symmetric-difference area 5 %, phase-aligned rms 4 %.
The Hausdorff distance is reported and not judged: one noisy point decides it.
A stick fraction of a smoothed motion is too large by nature (.270 where the truth is .213), hence the equal processing.
Above the bifurcation there is no cycle: two motions that slide steadily agree, one that sticks and one that does not
differ, whatever their curves.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from fmu_models.base.record import Recorded
from fmu_models.base.shown import Pictured, Shown

PHASES = 400  # points of a mean cycle
SCANLINES = 2000  # of the symmetric difference: area to 1e-3 of itself

LIMITS = {"amplitude": 0.03, "period": 0.01, "stick fraction": 0.02, "area": 0.05, "rms": 0.04}

MEANING = (
    "A pass means that mu_s is right within 2-3 % or p within 20 %, no more: different parameters can make nearly the "
    "same portrait. It does not prove the friction law; residuals against slip speed and a log left out of the fit "
    "say more."
)


@dataclass(frozen=True, eq=False)
class Stick(Shown):
    """Stick on one disc. fraction: share of time with |slip| below the threshold; strip: (PHASES,) share of the cycles
    that stick at each phase; squares: (n,) s^2, square of the time of each stick with the threshold's part taken off;
    real: whether the slip speed comes to zero rather than near it; held: (PHASES,) as strip, by the model's own contact
    states (None where measured)."""

    fraction: float
    strip: np.ndarray
    squares: np.ndarray
    real: bool
    held: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Portrait(Shown, Recorded):
    """A mean cycle. angle: (PHASES,) rad; speed: (PHASES,) rad/s; period: s; amplitude: rad, half range; sticks: by
    contact; cycles averaged."""

    RECORD = ("motion=words", "period", "amplitude", "stick_fraction", "sequence", "cycles")

    angle: np.ndarray
    speed: np.ndarray
    period: float
    amplitude: float
    sticks: Mapping[str, Stick]
    cycles: int

    @property
    def sequence(self) -> tuple[tuple[str, ...], ...]:
        """Which discs stick, one after the other within a cycle, from the first stick on after the angle has risen
        through the middle of its range. What is shorter than the acceptance level of a stick fraction is left out."""
        together = np.stack([(stick.strip > 0.5) & stick.real for stick in self.sticks.values()], axis=1)
        sets = [tuple(name for name, on in zip(self.sticks, row, strict=True) if on) for row in together]
        runs = [(group, len(list(same))) for group, same in groupby(sets)]
        if len(runs) > 1 and runs[0][0] == runs[-1][0]:  # a stick that lasts over the beginning
            runs = [*runs[1:-1], (runs[0][0], runs[0][1] + runs[-1][1])]
        sticks = [group for group, length in runs if group and length > LIMITS["stick fraction"] * PHASES]
        return tuple(group for group, _ in groupby(sticks))

    @property
    def words(self) -> str:
        """The motion in words, as in "stick on disc0, disc0 and disc1, disc1"."""
        return "stick on " + ", ".join(map(" and ".join, self.sequence)) if self.sequence else "a cycle without stick"

    @property
    def stick_fraction(self) -> dict[str, float]:
        """Share of time in stick, by contact."""
        return {name: stick.fraction for name, stick in self.sticks.items()}


@dataclass(frozen=True)
class Rest(Recorded):
    """Steady sliding: the mean angle, and half the range in which it stays, rad."""

    RECORD = ("motion=words", "angle", "swing")

    angle: float
    swing: float
    words: str = "steady sliding"


@dataclass(frozen=True)
class MetricVerdict:
    """One metric: value, what it is relative to, acceptance level (None: reported only) and whether it is kept."""

    name: str
    value: float
    limit: float | None
    passed: bool | None
    meaning: str


@dataclass(frozen=True)
class Settling(Shown):
    """When motions that begin before they have settled do so, s after the begin of the log; None: not within it.
    measured: of the log; model: of the model, from the log's first state."""

    measured: float | None
    model: float | None

    @property
    def words(self) -> str:
        """The settling in a sentence."""
        log, model = ("not within it" if t is None else f"after {t:.3g} s" for t in (self.measured, self.model))
        compared = (
            "all of it was compared, its size not judged" if self.measured is None else "it was compared from there on"
        )
        return (
            f"begins before its motion has settled, which it does {log} (the model from the same state: {model}); "
            + (f"{compared}, with the model from the log's own state")
        )


@dataclass(frozen=True, eq=False)
class PortraitComparison(Pictured, Recorded):
    """A measured motion, the model's, and the verdicts. drive_speeds: rad/s by contact, at which the model ran;
    settling: of a log that begins before its motion has settled; length, step: s, of the record and between its
    samples, with which the model ran (nan: not said)."""

    RECORD = ("log", "drive_speeds", "passed", "measured", "model", "metrics=verdicts", "settling", "meaning")
    COLUMNS = ("[metric]=verdicts.name", "value=verdicts.value", "limit=verdicts.limit", "passed=verdicts.passed")
    meaning = MEANING

    log: str
    drive_speeds: Mapping[str, float]
    measured: Portrait | Rest
    model: Portrait | Rest
    verdicts: tuple[MetricVerdict, ...]
    settling: Settling | None = None
    length: float = np.nan
    step: float = np.nan

    @property
    def passed(self) -> bool:
        """Whether every judged metric is kept."""
        return all(verdict.passed is not False for verdict in self.verdicts)

    @property
    def drives(self) -> str:
        """The drive speeds in words."""
        return ", ".join(f"{speed:.3g}" for speed in self.drive_speeds.values()) + " rad/s"

    def __getitem__(self, name: str) -> MetricVerdict:
        """A verdict by the name of its metric."""
        return next(verdict for verdict in self.verdicts if verdict.name == name)


def compare_motions(measured: Portrait | Rest, model: Portrait | Rest) -> tuple[MetricVerdict, ...]:
    """The metrics of `model_check.portraits`, each against its acceptance level; where one of the two has
    no stick, only whether the other has none either is judged."""
    first, second = sequence_of(measured), sequence_of(model)
    # where a cycle begins does not count
    same = len(first) == len(second) and any(
        first == second[shift:] + second[:shift] for shift in range(max(len(first), 1))
    )
    state = MetricVerdict(
        "same motion", float(not same), 0.0, same, f"measured: {measured.words}; model: {model.words}"
    )
    if isinstance(measured, Portrait) and isinstance(model, Portrait) and bool(first) == bool(second):
        return (state, *compare_portraits(measured, model))
    if isinstance(measured, Rest) and isinstance(model, Rest):
        value = model.angle / measured.angle - 1 if measured.angle else 0.0
        return (state, MetricVerdict("rest angle", value, None, None, "relative to measured"))
    return (state,)


def sequence_of(motion: Portrait | Rest) -> tuple[tuple[str, ...], ...]:
    """The sticks of a motion, one after the other; none where it rests."""
    return motion.sequence if isinstance(motion, Portrait) else ()


def compare_portraits(measured: Portrait, model: Portrait) -> tuple[MetricVerdict, ...]:
    """The metrics of two cycles."""
    scale = np.array([np.ptp(measured.angle), np.ptp(measured.speed)]) / 2
    first = np.stack([measured.angle, measured.speed], axis=1) / scale
    second = np.stack([model.angle, model.speed], axis=1) / scale
    share = "difference of the shares of time"
    sticks = {
        "stick fraction" + (f" {contact}" if len(measured.sticks) > 1 else ""): (
            model.sticks[contact].fraction - stick.fraction,
            share,
        )
        for contact, stick in measured.sticks.items()
    }
    values = {
        "amplitude": (model.amplitude / measured.amplitude - 1, "half range of the angle, relative to measured"),
        "period": (model.period / measured.period - 1, "relative to measured"),
        **sticks,
        "area": (
            symmetric_difference(first, second) / polygon_area(first),
            "area between the cycles, relative to the measured one's",
        ),
        "rms": (aligned_rms(first, second), "distance at equal phase, relative to the half ranges"),
        "hausdorff": (hausdorff(first, second), "greatest distance between the curves, relative to the half ranges"),
    }
    limits = {name: next((limit for key, limit in LIMITS.items() if name.startswith(key)), None) for name in values}
    return tuple(
        MetricVerdict(name, float(value), limit, None if limit is None else bool(abs(value) <= limit), meaning)
        for (name, (value, meaning)), limit in zip(values.items(), limits.values(), strict=True)
    )


def polygon_area(curve: np.ndarray) -> float:
    """Area inside a closed curve (n, 2)."""
    x, y = curve.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def symmetric_difference(first: np.ndarray, second: np.ndarray) -> float:
    """Area that lies inside one of two closed curves (n, 2), (m, 2) and not inside the other.

    Along a vertical line, all crossings of either curve sorted by height enclose the difference between the first and
    the second, the third and the fourth ..., because inside both is inside an even number of curves.
    """
    points = np.concatenate([first, second])
    low, high = points[:, 0].min(), points[:, 0].max()
    width = (high - low) / SCANLINES
    area = 0.0
    edges = np.concatenate([np.stack([curve, np.roll(curve, -1, axis=0)], axis=1) for curve in (first, second)])
    left, right = edges[:, :, 0].min(axis=1), edges[:, :, 0].max(axis=1)
    for x in low + width * (np.arange(SCANLINES) + 0.5):
        start, end = edges[(left <= x) & (x < right)].transpose(1, 0, 2)
        height = start[:, 1] + (x - start[:, 0]) / (end[:, 0] - start[:, 0]) * (end[:, 1] - start[:, 1])
        height.sort()
        area += width * float(np.sum(height[1::2] - height[::2]))
    return area


def aligned_rms(first: np.ndarray, second: np.ndarray) -> float:
    """Root mean square distance per coordinate of two curves (n, 2) at equal phase, the phase shifted for the best
    fit."""
    shifts = (np.mean((first - np.roll(second, shift, axis=0)) ** 2) for shift in range(len(second)))
    return float(np.sqrt(min(shifts)))


def hausdorff(first: np.ndarray, second: np.ndarray) -> float:
    """Greatest distance from a point of either closed curve (n, 2), (m, 2) to the other curve."""
    return max(float(_distances(first, second).max()), float(_distances(second, first).max()))


def _distances(points: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Distance (n,) of each point (n, 2) to a closed curve (m, 2)."""
    along = np.roll(curve, -1, axis=0) - curve
    away = points[:, None, :] - curve
    length = np.maximum(np.sum(along**2, axis=1), np.finfo(float).tiny)
    share = np.clip(np.sum(away * along, axis=2) / length, 0, 1)
    return np.sqrt(np.min(np.sum((away - share[:, :, None] * along) ** 2, axis=2), axis=1))
