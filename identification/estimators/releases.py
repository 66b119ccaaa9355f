"""Breakaway: the friction coefficient at which every stick of one driving disc lets go, and whether it ages.

The motion about each release tells x^2, x by how much the stick carried more than the law has at rest (`sticks`). A
contact that ages lets go at x = b log10(1 + t/t_0) beyond mu(0) after a stick of t s (``language/laws/ageing.py``): the
mean of x^2 over the sticks, weighed by what each of them tells, shows it; b follows where the sticks span a decade or
more: then their mean level is free, so that neither mu(0) nor t_0 matters (for t >> t_0). The deviation of that mean
has the scatter of the sticks, whatever sensors make it, and what law and constants leave open: these move all sticks
together. Where the law is wrong its mu(0) is, and levels beyond it say nothing of age: only their growth does.
"""

from dataclasses import dataclass

import numpy as np

from fmu_models.language.law_parameter import T_0
from identification.estimators.sticks import (
    FEWEST,
    LEAST,
    STEP,
    STEPS,
    Sticks,
    first_guess,
    only,
    release_of,
    searched,
    sensed,
    sticks_of,
)
from identification.inference.problem import Prior
from identification.laws.law import FittableLaw
from identification.measurement.pooled import Pool, RigValues, rig_values

SIGNIFICANT = 3.5  # standard deviations of a growth
BEYOND = 2.5  # standard deviations of the mean of x^2: one chance in 160
SHARE = 1e-3  # of an unknown or a constant, by which it is moved for a derivative
HOLD = 2.0  # median sticks that a hold lasts, at least
DECADE = 1.0  # decades of time in stick from which on their growth has a value


@dataclass(frozen=True)
class Release:
    """The end of one stick. log: number; time: s, on the log's clock; stick: s, how long it lasted; level: friction
    coefficient of the force that it carried last."""

    log: int
    time: float
    stick: float
    level: float


@dataclass(frozen=True)
class Breakaway:
    """Breakaway of all sticks. level: friction coefficient, with its standard deviation; at_rest: mu(0) of the fitted
    law; excess: x, of the level over that, root of the mean of x^2 (0 where that is below), with its deviation upward;
    square_deviation: of that mean, from noise, law and constants of the rig; growth: b, per decade of time in stick,
    with its own, None where the sticks span less than a decade; of_wrong_law: whether mu(0) is that of a law which
    misses the logs, or which another beats."""

    level: float
    deviation: float
    at_rest: float
    excess: float
    excess_deviation: float
    square_deviation: float
    growth: float | None
    growth_deviation: float | None
    releases: tuple[Release, ...]
    of_wrong_law: bool = False

    @property
    def ages(self) -> bool:
        """Whether sticks surely let go at more than the law has at rest, and later ones the more."""
        if self.growth is not None and self.growth_deviation is not None:
            return self.growth > SIGNIFICANT * self.growth_deviation
        return not self.of_wrong_law and self.excess**2 > BEYOND * self.square_deviation

    @property
    def span(self) -> tuple[float, float]:
        """Shortest and longest stick, s."""
        sticks = [release.stick for release in self.releases]
        return min(sticks), max(sticks)

    @property
    def words(self) -> str:
        """The breakaway in a sentence."""
        low, high = self.span
        text = (
            f"{len(self.releases)} sticks of {low:.2g} to {high:.2g} s let go at {self.level:.4f} ± "
            f"{self.deviation:.1g}, that is mu(0) {self.excess:+.4f} ± {self.excess_deviation:.1g}"
        )
        if self.growth is not None:
            return f"{text}; growth {self.growth:.4f} ± {self.growth_deviation:.1g} per decade of time in stick"
        if self.of_wrong_law:
            return f"{text}; this law is wrong, and so is its mu(0): whether breakaway ages, a law that fits will tell"
        return text

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to say where breakaway ages."""
        if not self.ages:
            return ()
        if self.growth is not None:
            return (
                f"Breakaway ages: it grows by {self.growth:.4f} ± {self.growth_deviation:.1g} with every decade of "
                "time in stick (law 'Conti+ageing'). Slips do not show it; the static coefficient is that of mu(0).",
            )
        return (
            f"Breakaway ages: sticks let go at {self.excess:.4f} ± {self.excess_deviation:.1g} above the friction that "
            "the slips have at rest (law 'Conti+ageing'). How fast it grows they do not say, for they span less than a "
            "decade of time: record holds, the drive stopped for 0.3 to 30 s and started again.",
        )


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fit as breakaway asks for it. names, values, covariance: (m,), (m,), (m, m) of all unknowns, those of the law
    first; held: constants that were taken as given; known: (n, n) covariance of their logarithms; shifts: (m, n) of the
    unknowns by these."""

    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    held: tuple[Prior, ...]
    known: np.ndarray
    shifts: np.ndarray


def breakaway(ready: Pool, law: FittableLaw, fit: Fitted) -> Breakaway | None:
    """Breakaway of the sticks of one driving disc; None where too few can be followed, or where nothing but an encoder
    shows the angle: after a release the body turns round, and between two lines nobody sees how."""
    sticks = sticks_of(ready)
    if sticks is None or any(motion.passes is not None for motion in ready.motions):
        return None
    count, size = len(law.parameters), len(fit.values)
    stated = {prior.name: prior.value for prior in (*ready.priors, *fit.held)}

    def bench(off: np.ndarray, chosen: Sticks) -> tuple[np.ndarray, RigValues, Sticks]:
        """Law, rig and what is seen, where unknowns and logarithms of constants are ``off`` (m + n,)."""
        x = fit.values + off[:size] + fit.shifts @ off[size:]
        values = stated | dict(zip(fit.names[count:], x[count:].tolist(), strict=True))
        values |= {prior.name: prior.value * float(np.exp(by)) for prior, by in zip(fit.held, off[size:], strict=True)}
        return x[:count], rig_values(values), sensed(chosen, values, ready)

    steps = np.concatenate([SHARE * np.maximum(np.abs(fit.values), SHARE), np.full(len(fit.held), SHARE)])
    q, rig, seen = bench(0 * steps, sticks)
    first = searched(seen, law, q, rig, first_guess(seen, law, q, rig, ready), STEPS)
    if np.count_nonzero(first.good) < FEWEST:
        return None
    usable, at = only(sticks, first.good), first.at[first.good]
    weight = first.weight[first.good] / first.weight[first.good].sum()
    q, rig, seen = bench(0 * steps, usable)
    resting = law.along(np.zeros(len(at)), usable.sign)

    def moved(off: np.ndarray) -> np.ndarray:
        """x^2 and mu(0) of each stick (n, 2), one step of the search from where it was found."""
        q, rig, seen = bench(off, usable)
        return np.stack([searched(seen, law, q, rig, at, 1).at[:, 1], law.value(resting, q)], axis=-1)

    nominal = moved(0 * steps)
    by = np.stack([(moved(step) - nominal) / step.max() for step in np.diag(steps)], axis=-1)
    squares, static = nominal.T
    beyond = np.sqrt(np.maximum(squares, 0.0))
    release = release_of(seen, law, q, rig, at[:, 0], beyond)
    durations = np.maximum(release - usable.begins, STEP)

    def power(slope: np.ndarray) -> float:
        """Variance that law and constants pass on, by the slope (m + n,)."""
        of_fit, of_constants = slope[:size], slope[size:]
        return float(of_fit @ fit.covariance @ of_fit + of_constants @ fit.known @ of_constants)

    def deviation(weights: np.ndarray, departures: np.ndarray) -> float:
        """Deviation of a sum of squares (n,) with weights (n,) and errors ``departures`` (n,)."""
        many = np.count_nonzero(weights)
        scatter = float(weights**2 @ departures**2) * many / max(many - 2, 1)
        return float(np.sqrt(scatter + power(weights @ by[:, 0])))

    square = float(weight @ squares)
    square_deviation = deviation(weight, squares - square)
    excess = float(np.sqrt(max(square, 0.0)))
    excess_deviation = float(np.sqrt(excess**2 + square_deviation)) - excess
    growth, slope, spare = _growth(durations, beyond)
    by_square = 0.5 / np.maximum(beyond, LEAST)
    return Breakaway(
        level=float(static.mean()) + excess,
        deviation=float(np.sqrt(excess_deviation**2 + power(by[:, 1].mean(axis=0)))),
        at_rest=float(static.mean()),
        excess=excess,
        excess_deviation=excess_deviation,
        square_deviation=square_deviation,
        growth=growth,
        growth_deviation=None if growth is None else deviation(slope * by_square, spare / by_square),
        releases=tuple(
            Release(int(log), float(time), float(stick), float(value))
            for log, time, stick, value in zip(usable.log, release, durations, static + beyond, strict=True)
        ),
    )


def _growth(durations: np.ndarray, beyond: np.ndarray) -> tuple[float | None, np.ndarray, np.ndarray]:
    """Growth of x (n,) per decade of time in stick (n,), s, None where the sticks span less than one; its weights (n,);
    what it leaves of x (n,)."""
    decades = np.log10(1 + durations / T_0)
    # the little that short sticks have aged is told less surely: of enough holds these alone tell the growth
    holds = durations > HOLD * np.median(durations)
    alone = np.count_nonzero(holds) >= FEWEST and float(np.ptp(decades[holds])) >= DECADE
    chosen = holds if alone else np.ones(len(durations), dtype=bool)
    if np.ptp(decades[chosen]) < DECADE:
        return None, np.zeros(len(durations)), beyond
    spread = np.where(chosen, decades - decades[chosen].mean(), 0.0)
    slope = spread / float(spread @ spread)
    growth = float(slope @ beyond)
    return growth, slope, beyond - beyond[chosen].mean() - growth * spread
