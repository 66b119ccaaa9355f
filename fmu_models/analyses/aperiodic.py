"""What a motion is that repeats itself after no number of steps, by its exponents with their errors and by its means.

    chaos        the largest exponent is positive, by more than SURE errors and than ZERO
    torus        no exponent is positive, weighted means of both halves of the run agree to DIGITS digits, as those of
                 smooth motions of several frequencies do, also of a run four times as long, and its points fill more
                 than FILLED dimensions, there or in a run four times longer still: near a resonance they fill it late
    strange      a phase that only turns drives the others; the largest exponent of these is negative, and yet what they
                 change by with the phase grows without bound: strange, but no chaos. Where that is bounded: torus
    cycle        of what nothing forces, seen at times of no meaning to it: all exponents but that along the motion are
                 negative; a torus of it has one dimension more, or it is one of the cycles about a centre
    not decided  otherwise: the accumulation of flips, slow transients

An exponent that is not larger than its error is computed again from longer runs. The weights exp(-1/(t (1 - t))) make
means of a quasi-periodic motion converge faster than any power of its length.

Sources: Das, Saiki, Sander, Yorke, Quantitative quasiperiodicity, Nonlinearity 30 (2017); of the strange ones Pikovsky,
Feudel, Characterizing strange nonchaotic attractors, Chaos 5 (1995), section III.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from fmu_models.base.arrays import Varied, Vector
from fmu_models.base.shown import Shown
from fmu_models.families import jobs as families
from fmu_models.families.execution import Runner
from fmu_models.families.jobs import Jobs
from fmu_models.sections.system import SectionSystem

CHAOS, TORUS, CYCLE, STRANGE, NOT_DECIDED = "chaos", "torus", "cycle", "strange nonchaotic", "not decided"
SURE = 5.0  # standard errors by which an exponent differs from zero
ZERO = 1e-3  # per step: an exponent below it in size is none
STEPS, STAGES = 1024, 3  # of the first run, and how often it is made four times longer
BATCHES, FEWEST = 128, 24  # of a run, and those that still tell a scatter
DIGITS = 6.0
FILLED = 0.8  # dimensions: of less is what flips accumulate at
MOST_FILLED = 3.0
FEW, MANY = 128, 1024  # points between whose neighbours a dimension is told
TORUS_STEPS = 4096
PHASES, SENSITIVE = 12, 2.0  # motions at several phases; what a run 16 times longer changes more by is not bounded


@dataclass(frozen=True)
class AperiodicVerdict(Shown):
    """The verdict on an aperiodic motion.

    Attributes:
        kind: one of those of the module.
        exponent, error: the largest one per step, but that along a motion which nothing forces, and its standard error.
    """

    kind: str
    exponent: float
    error: float

    @property
    def sign(self) -> str:
        """Sign of the exponent: "positive", "negative", "zero" or "not decided"."""
        return sign_of(self.exponent, self.error)


def sign_of(exponent: float, error: float) -> str:
    """Sign of an exponent per step; "not decided" where its error does not tell."""
    if abs(exponent) <= ZERO and SURE * error <= ZERO:
        return "zero"
    if not abs(exponent) > max(ZERO, SURE * error):
        return NOT_DECIDED
    return "positive" if exponent > 0.0 else "negative"


def largest_exponents(
    runner: Runner,
    system: SectionSystem,
    starts: Vector,
    varied: Varied | None = None,
    stages: int = STAGES,
    steps: int = STEPS,
) -> tuple[Vector, Vector, Vector]:
    """(m,) largest exponents of the motions from starts (m, n) per step, their standard errors, and how long a step is;
    nan where a motion does not go on. But for that along a motion which nothing forces, where the section is one of
    time."""
    values, errors, lasted = np.full(len(starts), np.nan), np.full(len(starts), np.inf), np.full(len(starts), np.nan)
    remaining, ends = np.arange(len(starts)), np.array(starts, dtype=float)
    # along the motion, of a phase or of what drifts: the nearest to zero are left out
    left_out = system.autonomous + len(system.driven) + len(system.drifting)
    tangents = {"tangents": min(system.dimension, 1 + left_out), "flow": system.autonomous}
    for _ in range(stages):
        subset = {name: v[remaining] for name, v in (varied or {}).items()}
        jobs = Jobs(ends[remaining], subset, BATCHES, BATCHES, max(1, steps // BATCHES), **tangents)
        rows = runner.make(jobs, quiet=True)
        sound = rows.filled == BATCHES
        growth = rows.growth / jobs.batch
        means = growth.mean(axis=1)
        for _ in range(left_out):
            means[np.arange(len(means)), np.nan_to_num(np.abs(means), nan=np.inf).argmin(axis=1)] = np.nan
        k = np.argmax(np.where(np.isnan(means), -np.inf, means), axis=1)
        largest = growth[np.arange(len(k)), :, k]
        values[remaining] = np.where(sound, largest.mean(axis=1), np.nan)
        lasted[remaining] = rows.times.mean(axis=1) / jobs.batch
        errors[remaining] = [_error(g) if fine else np.inf for g, fine in zip(largest, sound, strict=True)]
        ends[remaining] = np.where(sound[:, None], rows.ends, ends[remaining])
        open_ = [sign_of(values[i], errors[i]) == NOT_DECIDED and np.isfinite(values[i]) for i in remaining]
        remaining, steps = remaining[open_], 4 * steps
        if not remaining.size:
            break
    return values, errors, lasted


def _error(batches: Vector) -> float:
    """Standard error of the mean of batches (k,), the largest over longer and longer ones: they remember each other."""
    if not np.isfinite(batches).all():
        return 0.0  # every difference is lost
    largest, length = 0.0, 1
    while batches.size // length >= FEWEST:
        count = batches.size // length
        longer = batches[: count * length].reshape(count, length).mean(axis=1)
        largest = max(largest, float(longer.std(ddof=1)) / np.sqrt(count))
        length *= 2
    return largest


def judged(runner: Runner, system: SectionSystem, start: Vector) -> AperiodicVerdict:
    """What the motion from a point (n,) is, on which it stays and does not repeat itself."""
    exponent, error = _largest(runner, system, start, 1)
    # of what nothing forces a cycle is as smooth as a torus, of what a phase drives all is: there the exponent tells
    smooth = not (system.autonomous or system.driven)
    if sign_of(exponent, error) == NOT_DECIDED and not (smooth and _is_torus(runner, system, start)):
        exponent, error = _largest(runner, system, start, STAGES)
    sign = sign_of(exponent, error)
    kind = NOT_DECIDED
    if sign == "positive":
        kind = CHAOS
    elif system.driven:
        if sign == "negative":
            kind = TORUS if _is_smooth_in_phase(runner, system, start) else STRANGE
    elif system.autonomous and sign == "negative":
        kind = CYCLE
    elif _is_torus(runner, system, start):
        kind = TORUS
    return AperiodicVerdict(kind, exponent, error)


def _largest(runner: Runner, system: SectionSystem, start: Vector, stages: int) -> tuple[float, float]:
    values, errors, _ = largest_exponents(runner, system, start[None], stages=stages)
    return float(values[0]), float(errors[0])


def _is_torus(runner: Runner, system: SectionSystem, start: Vector) -> bool:
    """Whether the points of longer and longer runs are those of a smooth motion of several frequencies."""
    for steps in (TORUS_STEPS, 4 * TORUS_STEPS, 16 * TORUS_STEPS):
        rows = runner.make(Jobs(start[None], rows=steps), quiet=True)
        signals = _signals(system, rows.points[0])
        if rows.outcomes[0] != families.FINISHED or not signals.shape[1] or digits(signals) < DIGITS:
            return False
        if steps > TORUS_STEPS and FILLED + system.autonomous < dimension(signals) < MOST_FILLED:
            return True
    return False


def _is_smooth_in_phase(runner: Runner, system: SectionSystem, start: Vector) -> bool:
    """Whether what the states change by with the phase that drives them stays bounded, along one of several motions."""
    rows = runner.make(Jobs(start[None], rows=TORUS_STEPS), quiet=True)
    starts = rows.points[0, :: TORUS_STEPS // PHASES][:PHASES]
    rows = runner.make(Jobs(starts, rows=16 * TORUS_STEPS, derivatives=True), quiet=True)
    change = np.zeros(starts.shape)
    change[:, system.driven] = 1.0
    largest = np.zeros((16 * TORUS_STEPS, len(starts)))
    for k in range(len(largest)):
        change = np.einsum("mij,mj->mi", rows.derivatives[:, k], change)
        largest[k] = np.abs(change).max(axis=1)
    short, long = largest[:TORUS_STEPS].max(axis=0).min(), largest.max(axis=0).min()
    return bool(long < SENSITIVE * short)


def _signals(system: SectionSystem, points: Vector) -> Vector:
    """(k, s) what varies, in its standard deviations; of an angle the cosine and the sine."""
    columns: list[Vector] = []
    for values, turn in zip(points.T, system.turns, strict=True):
        angle = 2.0 * np.pi * values / turn
        columns += [np.cos(angle), np.sin(angle)] if np.isfinite(turn) else [values]
    signals = np.stack(columns, axis=1)
    spread = signals.std(axis=0)
    varies = spread > 1e-9 * (np.abs(signals).max(axis=0, initial=0.0) + 1e-300)
    return signals[:, varies] / spread[varies]


def birkhoff_weights(count: int) -> Vector:
    """(count,) weights of a mean over as many steps; see the module."""
    t = (np.arange(count) + 0.5) / count
    return np.exp(-1.0 / (t * (1.0 - t)))


def digits(signals: Vector) -> float:
    """The number of digits to which the weighted means of both halves of signals (k, s) agree, at least."""
    half = len(signals) // 2
    weights = birkhoff_weights(half)
    weights /= weights.sum()
    deviation = np.abs(weights @ signals[:half] - weights @ signals[half : 2 * half]).max()
    return float(-np.log10(max(deviation, 1e-17)))


def dimension(signals: Vector) -> float:
    """Dimension of the set that signals (k, s) fill: how the distance of neighbours falls with their number."""

    def neighbour(points: Vector) -> float:
        distances = KDTree(points).query(points, k=2)[0][:, 1]
        return float(np.log(distances[distances > 0.0]).mean()) if (distances > 0.0).any() else -np.inf

    # by chance, and few of many: in their order points of a rotation lie at the distances of its continued fraction
    mixed = np.random.default_rng(0).permutation(signals)[: 8 * MANY]
    many = np.mean([neighbour(part) for part in np.array_split(mixed, len(mixed) // MANY)])
    coarse = np.mean([neighbour(part) for part in np.array_split(mixed, len(mixed) // FEW)])
    return float(np.log(MANY / FEW) / (coarse - many)) if coarse > many else np.inf
