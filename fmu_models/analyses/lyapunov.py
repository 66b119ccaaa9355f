"""Lyapunov exponents: the mean growth rates of small differences, per step of a section and per unit of time.

    Q(k+1) R(k+1) = DP(x(k)) Q(k),    lambda_i = mean of ln |R_ii(k)|,    their sum = mean of ln |det DP(x(k))|

Several motions are followed, from starts that differ by a millionth of the sizes of the states; what each grows by is
summed in batches. The error of a mean is that of its batches, whose memory (integrated autocorrelation time) counts;
that of many motions is the scatter of theirs. Where stick, or an impact without rebound, takes a difference away, its
exponent is -inf, not the logarithm of a rounding error. A motion that nothing forces has an exponent of zero, that
along the motion; it is followed by itself, and how near it comes to zero is a check. A motion that is chaotic for a
while only shows two values: batches before and after a change point that no scatter explains.

Sources: Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15 (1980); Sokal, Monte Carlo methods in statistical
mechanics (1997), section 3 (the window of the autocorrelation).
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from fmu_models.analyses.declaration import Analysis, Option
from fmu_models.base.arrays import Flags, Integers, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Pictured
from fmu_models.families import jobs as families
from fmu_models.families.execution import IN_MEMORY, Execution, Runner
from fmu_models.families.jobs import Jobs
from fmu_models.families.store import PROVENANCE, told
from fmu_models.sections.subject import Subject, seen
from fmu_models.sections.system import SectionSystem
from fmu_models.simulation.rows import RunRows

if TYPE_CHECKING:
    import xarray

SPREAD = 1e-6  # of the size of each state: by so much the starts differ
BATCHES = 1000  # of one motion, at most
WINDOW = 5.0  # autocorrelation times over which the autocorrelation is summed
SHARE, FARTHEST = 0.5, 200  # of a motion, and in batches: how far back it is looked for
CHANGED = 8.0  # standard errors by which a change of the mean is no scatter
MANY = 32  # motions whose scatter tells the error by itself, whatever the batches remember
IDENTITY_STEPS = 2  # over which the sum of the exponents is compared with the volumes
SHORTEST = 10  # batches on either side of a change point


@dataclass(frozen=True)
class Transient:
    """A motion that was another one at first.

    Attributes:
        value: the largest exponent until then, but for that along the motion, per unit of time.
        steps: how long that lasted, on the mean of the motions that changed.
        motions: how many of them did.
    """

    value: float
    steps: float
    motions: int


@dataclass(frozen=True, eq=False)
class Exponents(Pictured):
    """Lyapunov exponents and how well they are known.

    Attributes:
        values: (n,) per step, largest first; -inf where every difference is lost.
        errors: (n,) standard errors of the values.
        per_time, per_time_errors: (n,) the same per unit of time.
        unit: of that time.
        steps: number of steps that the mean is taken of, all motions together.
        zero: index of the exponent along a motion that nothing forces, the one nearest to zero; None where something
            forces it.
        lost: how many are -inf.
        shares: per contact the share of the time in contact or stick.
        sum: of all exponents, per step.
        identity: by how much, relative, the sum misses what the volumes of differences do over some steps: of an
            oscillator the integral of the divergence, of a map its determinant; None where that is not known, because
            friction, impacts or the memory of a stop change volumes too.
        transient: what the motion was at first; None if it did not change.
        how: of ``SectionSystem``.
        model: its name.
        provenance: what it was made of; see ``Execution``.
    """

    COLUMNS: ClassVar = (
        *("[exponent]=numbers", "per_step=values", "error=errors", "per_time", "per_time_error=per_time_errors"),
    )
    RECORD: ClassVar = (
        *("model", "exponents=values", "errors", "per_time", "per_time_errors", "unit", "steps", "zero", "identity"),
        *("lost", "shares", "transient", "how"),
    )

    values: Vector
    errors: Vector
    per_time: Vector
    per_time_errors: Vector
    unit: str
    steps: int
    zero: int | None
    lost: int
    shares: Mapping[str, float]
    transient: Transient | None = None
    how: str = ""
    identity: float | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)
    model: str = ""

    @property
    def sum(self) -> float:
        """See the class."""
        return float(self.values.sum())

    @property
    def dimension(self) -> float:
        """Kaplan and Yorke's: how many exponents, with a fraction of the next one, add up to zero."""
        values = self.values
        total, k = 0.0, 0
        while k < len(values) and total + values[k] >= 0.0:
            total += float(values[k])
            k += 1
        if k == len(values):
            return float(k)
        return k + (total / abs(float(values[k])) if np.isfinite(values[k]) else 0.0)

    @property
    def numbers(self) -> range:
        """Numbers of the exponents, from 1."""
        return range(1, len(self.values) + 1)

    def to_xarray(self) -> "xarray.Dataset":
        """The table, with its unit and where it comes from."""
        return super().to_xarray().assign_attrs({"unit": self.unit, PROVENANCE: told(self.provenance)})

    def _contents(self) -> Mapping[str, Any]:
        contents = {"per step": self.values, "errors": self.errors, f"per {self.unit}": self.per_time}
        told_ = {"identity": self.identity, "transient": self.transient, "how": self.how or None}
        return {**contents, "steps": self.steps, "zero": self.zero, **told_}

    def _heading(self) -> str:
        return f"{len(self.values)} Lyapunov exponents"


def lyapunov(
    system: Subject,
    start: Mapping[str, float] | Sequence[float] | None = None,
    *,
    periods: Annotated[int, Option("Steps of the section, all motions together.", minimum=2, flag="steps")] = 100_000,
    transient: Annotated[int, Option("Steps of each motion before that.", minimum=0)] = 1000,
    motions: Annotated[int, Option("Motions that are followed.", minimum=2)] = 8,
    seed: int = 0,
    execution: Execution = IN_MEMORY,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> Exponents:
    """Find all Lyapunov exponents of a motion, with their errors.

    Args:
        system: a map, an oscillator at a section, or a model as it is, where nothing forces it.
        start: a point; the default of the model if left out.
        periods: steps of the section for the mean, all motions together.
        transient: steps of each before that, in which it comes to where it stays.
        motions: how many are followed, at least 2.
        seed: of their starts.
        execution: Who makes the runs, and where they are kept.
        progress: called with the fraction done.

    Raises:
        StickslipError: fewer than 2 motions or steps for them; a motion goes to infinity, does not meet the section, or
            cannot be continued; as ``Runner``.
    """
    steps = periods // max(1, motions)
    if motions < 2 or steps < 1 or transient < 0:
        raise StickslipError(
            f"Exponents of {motions} motions over {periods} steps: take at least 2 motions and 1 step."
        )
    system = seen(system)
    point = system.start(start)
    sizes = np.where(np.isfinite(system.sizes()) & (point != 0.0), system.sizes(), 0.0)
    sizes = np.where(sizes.any(), sizes, system.sizes())
    starts = point + SPREAD * sizes * np.random.default_rng(seed).uniform(-1.0, 1.0, (motions, len(point)))
    # a power of two: a mean over whole periods of what has doubled its period is exact
    batch = 1 << (-(-steps // BATCHES) - 1).bit_length()
    k = system.dimension
    jobs = Jobs(starts, {}, transient, steps // batch, batch, tangents=k, flow=system.autonomous)
    plan = {"analysis": "lyapunov", "start": point, "periods": periods, "transient": transient, "motions": motions}
    plan["seed"] = seed
    with Runner(system, plan, execution, progress) as runner:
        rows = runner.make(jobs)
        inside = (rows.outcomes == families.BROKEN) & (rows.steps == 0)
        if inside.any() and not inside.all():
            # of a wall that is closed at the start: to its other side
            starts = np.where(inside[:, None], 2.0 * point - starts, starts)
            rows = runner.make(dataclasses.replace(jobs, starts=starts))
        _check(system, starts[0], rows)
        exponents, identity = _exponents(system, rows, batch), _identity(runner, system, rows.ends[:1], k)
        return runner.finish(dataclasses.replace(exponents, identity=identity, provenance=runner.provenance))


def _identity(runner: Runner, system: SectionSystem, start: Vector, tangents: int) -> float | None:
    """By how much the growth of all differences misses that of their volume."""
    if system.log_volumes(start[:0]) is None or tangents < start.shape[1]:
        return None
    rows = runner.make(Jobs(start, rows=IDENTITY_STEPS + 1, tangents=tangents), quiet=True)
    growth, volumes = rows.growth[0, 1:].sum(), system.log_volumes(rows.points[0, :-1])
    if volumes is None or not np.isfinite(growth) or not np.isfinite(volumes).all() or not volumes.sum():
        return None
    return float(abs(growth / volumes.sum() - 1.0))


def _check(system: SectionSystem, point: Vector, rows: RunRows) -> None:
    bad = np.flatnonzero(rows.outcomes > families.ABSORBED)
    if not bad.size:
        return
    coordinates = ", ".join(f"{name} = {value:g}" for name, value in zip(system.states, point, strict=True))
    first, steps = int(bad[0]), int(rows.steps[bad[0]])
    escaped = rows.outcomes[first] == families.ESCAPED
    why = "leaves every bound" if escaped else f"cannot be continued ({families.reason(rows, first)})"
    raise StickslipError(
        f"{system.name}: the motion from {coordinates} {why} after {steps} steps, so it has no exponents. Start "
        "elsewhere, or change the parameters."
    )


def _exponents(system: SectionSystem, rows: RunRows, batch: int) -> Exponents:
    growth, times = rows.growth, rows.times
    # where nothing forces it the first lies along the motion, until rounding turns it to what grows most; then the
    # second does: both together grow as what grows most
    begins, transient = _changes(growth[..., : 1 + system.autonomous].sum(axis=-1), times, batch)
    used = np.arange(times.shape[1]) >= begins[:, None]
    if transient is not None:
        used &= (begins > 0)[:, None]
    values, errors, per_time, per_time_errors = (np.empty(growth.shape[-1]) for _ in range(4))
    steps = int(used.sum()) * batch
    ones = np.full_like(times, float(batch))
    for i in range(growth.shape[-1]):
        values[i], errors[i] = _mean(growth[..., i], ones, used)
        per_time[i], per_time_errors[i] = _mean(growth[..., i], times, used)
    order = np.argsort(-values, kind="stable")
    # where differences grow, rounding turns the one that begins along the motion towards the one that grows most
    zero = int(np.abs(values[order]).argmin()) if system.autonomous else None
    total = float(times[used].sum())
    shares = {name: float(rows.held[..., c][used].sum()) / total for c, name in enumerate(system.contacts)}
    values, errors, per_time, per_time_errors = (c[order] for c in (values, errors, per_time, per_time_errors))
    counts = system.unit, steps, zero, int((~np.isfinite(values)).sum())
    columns = values, errors, per_time, per_time_errors
    return Exponents(*columns, *counts, shares, transient, system.how, model=system.name)


def _mean(growth: Vector, weights: Vector, used: Flags) -> tuple[float, float]:
    """Growth (motions, batches) per weight over what is kept, and its standard error."""
    kept = growth[used]
    if not np.isfinite(kept).all():
        return -np.inf, 0.0
    total = float(weights[used].sum())
    value = float(kept.sum()) / total
    if len(growth) >= MANY:
        lengths = (weights * used).sum(axis=1)
        residuals = (growth * used).sum(axis=1) - value * lengths
        return value, float(np.sqrt((residuals @ residuals) * len(residuals) / (len(residuals) - 1)) / total)
    series = [(g - value * w)[k] for g, w, k in zip(growth, weights, used, strict=True)]
    series = [segment for segment in series if segment.size > 1]
    count = sum(segment.size for segment in series)
    if not count:
        return value, float("nan")
    variance = sum(float(segment @ segment) for segment in series) / count
    return value, float(np.sqrt(count * variance * _memory(series)) / total)


def _memory(series: list[Vector]) -> float:
    """Integrated autocorrelation time of batches of mean zero, in batches: 1 where they know nothing of each other."""
    shortest = min(segment.size for segment in series)
    lags = max(2, min(int(SHARE * shortest), FARTHEST))
    covariance = np.zeros(lags)
    for segment in series:
        size = 1 << int(2 * segment.size - 1).bit_length()
        spectrum = np.fft.rfft(segment, size)
        covariance += np.fft.irfft(spectrum * spectrum.conj(), size)[:lags]
    if covariance[0] <= 0.0:
        return 1.0
    correlation = covariance / covariance[0]
    summed = 1.0 + 2.0 * np.cumsum(correlation[1:])
    within = np.flatnonzero(np.arange(1, lags) >= WINDOW * summed)
    return float(max(summed[within[0] if within.size else -1], 1.0 / WINDOW))


def _changes(growth: Vector, times: Vector, batch: int) -> tuple[Integers, Transient | None]:
    """Per motion the batch from which on its growth is another one, 0 where it does not change; what it was before."""
    m, n = growth.shape
    begins = np.zeros(m, np.int64)
    before, passed = [], []
    if n < 4 * SHORTEST or not np.isfinite(growth).all():
        return begins, None
    at, g = np.arange(SHORTEST, n - SHORTEST), growth / times
    total = np.cumsum(g, axis=1)
    left, right = total[:, at - 1] / at, (total[:, -1:] - total[:, at - 1]) / (n - at)
    index = np.argmax(at * (n - at) * (left - right) ** 2, axis=1)
    cuts, left, right = at[index], left[np.arange(m), index], right[np.arange(m), index]
    rounding = 1e-9 * (abs(left) + abs(right))
    clear = np.maximum(abs(left - right) - rounding, 0.0) / CHANGED
    variances = clear**2 / (1 / cuts + 1 / (n - cuts))
    # the mean of both scatters, which the larger one exceeds: most motions are done with it
    within = g.var(axis=1) - cuts * (n - cuts) * ((left - right) / n) ** 2
    for i in np.flatnonzero((variances > 0.0) & (variances > 0.99 * within / WINDOW)).tolist():
        cut, variance = int(cuts[i]), float(variances[i])
        segments = [g[i, :cut] - g[i, :cut].mean(), g[i, cut:] - g[i, cut:].mean()]
        scatters = [float(segment @ segment) / segment.size for segment in segments]
        # the larger of the two scatters for both: a short part tells little of its own, a periodic one has none; that
        # memory makes of them what it takes is asked only where it may be too little at its shortest
        if variance > max(scatters) / WINDOW and variance > max(
            scatter * _memory([segment]) for scatter, segment in zip(scatters, segments, strict=True)
        ):
            begins[i] = cut
            before.append(float(growth[i, :cut].sum() / times[i, :cut].sum()))
            passed.append(cut * batch)
    if not before:
        return begins, None
    return begins, Transient(float(np.mean(before)), float(np.mean(passed)), len(before))


def _numbers(exponents: Exponents) -> dict[str, float]:
    values: dict[str, float] = {}
    pairs = zip(exponents.per_time.tolist(), exponents.per_time_errors.tolist(), strict=True)
    for i, (value, error) in enumerate(pairs, 1):
        values |= {f"exponent{i}": value, f"error{i}": error}
    return {**values, **{f"{name}_share": share for name, share in exponents.shares.items()}}


def _of_run(count: int) -> dict[str, int]:
    """Four motions for the length of the run, of which a quarter is left out first."""
    return {"periods": 4 * (count - count // 4), "transient": count // 4, "motions": 4}


ANALYSIS = Analysis(
    function=lyapunov,
    numbers=_numbers,
    results="`exponent1` per unit of time, `error1`, and so on, `<contact>_share`",
    example="hinge_clearance --forcing f --set f=0.41 --start x=0 --steps 20000",
    label="exponents",
    page=False,
    of_run=_of_run,
)
