"""Orbit diagrams: where motions stay at the section, over a parameter, up and down.

A sweep goes on from where the motion of the value before ended, and starts anew where that failed. A period is claimed
where Newton's method solves for it; what repeats itself after no period that was looked for is 0: chaos, or a motion
of two frequencies, or one that is not there yet, which the sign of the largest exponent tells apart.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fmu_models.analyses.aperiodic import largest_exponents, sign_of
from fmu_models.analyses.attractors import claimed
from fmu_models.analyses.branch import special_values
from fmu_models.analyses.declaration import SHOWN, VALUES, Analysis, Option
from fmu_models.analyses.unforced import at_maxima
from fmu_models.base.arrays import Integers, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import Spanned
from fmu_models.base.shown import Pictured
from fmu_models.continuation.branch import Branch
from fmu_models.continuation.branches import Branches
from fmu_models.continuation.lost_motions import LostMotion, lost_motions
from fmu_models.continuation.overlay import Motion, branches_through
from fmu_models.families import jobs as families
from fmu_models.families.execution import IN_MEMORY, Execution, Runner
from fmu_models.families.jobs import Jobs
from fmu_models.families.store import PROVENANCE, told
from fmu_models.sections.amounts import Amount, Measured, shown_of
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.system import SectionSystem

if TYPE_CHECKING:
    import pandas
    import xarray

DIRECTIONS = {"up": ("up",), "down": ("down",), "both": ("up", "down")}
SETTLED = 1e-11


@dataclass(frozen=True, eq=False)
class Diagram(Pictured):
    """Of d directions, m values, r points at most, n states.

    Attributes:
        model, over, of: names of the model, of the parameter, and of what a picture shows: a state or a quantity.
        states, contacts: names.
        values: (m,) of the parameter.
        directions: of the sweeps: "up", "up_2" from the second start, "down" and so on.
        points: (d, m, r, n); nan beyond the period of a motion that has one, and where a run failed.
        periods: (d, m) in steps of the section; 0 where none was claimed.
        began: (d, m, contacts) how often each contact or stick begins in a period.
        exponents: (d, m) largest one per step, of the logarithm of the largest multiplier where a period is claimed;
            nan where it was not asked for.
        amount: the quantity, if a picture shows one.
        amounts: (d, m, r) it, in the period of a motion that has one, else in the step from each point.
        exponent_errors: (d, m) their standard errors; 0 where a period is claimed, infinite where there is no exponent.
        durations: (d, m) of a step, in ``unit``; empty where exponents were not asked for.
        failures: why a run ended early, by direction and value.
        steps: of the section, all runs together.
        how: of ``SectionSystem``.
        provenance: what it was made of; see ``Execution``.
        units: of states and of the parameter.
        branches: laid over it, if that was asked for.
        lost: where a sweep left a stable branch that goes on, if that was asked for.
    """

    RECORD: ClassVar = (
        *("model", "over", "values", "directions", "periods", "words", "steps", "exponents=per_time"),
        *("failures=refused", "branches=laid", "lost", "how", "amounts"),
    )

    model: str
    over: str
    states: tuple[str, ...]
    contacts: tuple[str, ...]
    values: Vector
    directions: tuple[str, ...]
    points: Vector
    periods: Integers
    began: Integers
    exponents: Vector
    failures: Mapping[tuple[str, float], str]
    steps: int
    of: str
    how: str = ""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    branches: Branches | None = None
    lost: tuple[LostMotion, ...] | None = None
    exponent_errors: Vector = field(default_factory=lambda: np.zeros((0, 0)))
    durations: Vector = field(default_factory=lambda: np.zeros((0, 0)))
    unit: str = "s"
    amount: Amount | None = None
    amounts: Vector | None = None

    @property
    def shown(self) -> Vector:
        """(d, m, r) what a picture shows of points."""
        if self.amounts is not None:
            return self.amounts
        return self.points[..., self.states.index(self.of)]

    @property
    def per_time(self) -> Vector:
        """(d, m) largest exponents per ``unit``; empty where they were not asked for."""
        return self.exponents / self.durations if self.durations.size else self.durations

    @property
    def ways(self) -> tuple[str, ...]:
        """Up or down, of each sweep."""
        return tuple(direction.split("_")[0] for direction in self.directions)

    def sign(self, direction: int, value: int) -> str:
        """Sign of the exponent, by its error: "positive", "negative", "zero" or "not decided"."""
        return sign_of(float(self.exponents[direction, value]), float(self.exponent_errors[direction, value]))

    def word(self, direction: int, value: int) -> str:
        """n-p-q: period, and how often each contact begins in it; empty where no period is claimed."""
        period = self.periods[direction, value]
        return "-".join(map(str, (period, *self.began[direction, value]))) if period else ""

    @property
    def words(self) -> list[list[str]]:
        """``word`` of every direction and value."""
        return [[self.word(d, i) for i in range(len(self.values))] for d in range(len(self.directions))]

    @property
    def laid(self) -> tuple[Branch, ...]:
        """The branches laid over it."""
        return self.branches.branches if self.branches else ()

    @property
    def refused(self) -> list[str]:
        """``failures`` in words."""
        return [f"{direction}, {self.over} = {value:g}: {why}" for (direction, value), why in self.failures.items()]

    @property
    def spanned(self) -> Spanned:
        """The parameter, and what is shown of the motions."""
        return Spanned(self.over, self.of, (self.over,), self.states)

    @property
    def frame(self) -> "pandas.DataFrame":
        """One row per point."""
        import pandas

        d, m, r = np.nonzero(np.isfinite(self.points[..., 0]))
        columns = {"direction": np.array(self.directions)[d], self.over: self.values[m], "period": self.periods[d, m]}
        columns |= {name: self.points[d, m, r, i] for i, name in enumerate(self.states)}
        columns |= {"exponent": self.per_time[d, m]} if self.durations.size else {}
        columns |= {} if self.amounts is None else {self.of: self.amounts[d, m, r]}
        return pandas.DataFrame(columns)

    def to_xarray(self) -> "xarray.Dataset":
        """The arrays with their dimensions."""
        import xarray

        cells = ("direction", self.over)
        index = {"direction": np.array(self.directions, object), self.over: self.values}
        data: dict[str, Any] = {n: ((*cells, "point"), self.points[..., i]) for i, n in enumerate(self.states)}
        data |= {} if self.amounts is None else {self.of: ((*cells, "point"), self.amounts)}
        data |= {"period": (cells, self.periods), "exponent": (cells, self.exponents)}
        data |= {"exponent_error": (cells, self.exponent_errors)}
        data |= {f"{name}_began": (cells, self.began[..., i]) for i, name in enumerate(self.contacts)}
        return xarray.Dataset(data, index, {"model": self.model, PROVENANCE: told(self.provenance)})

    def _heading(self) -> str:
        return f"Diagram of {self.model} over {self.over}: {len(self.values)} values, {', '.join(self.directions)}"

    def _contents(self) -> Mapping[str, Any]:
        counts = {"periods": np.unique(self.periods), "failures": len(self.failures)}
        return {self.over: self.values, **counts, "how": self.how or None}


def orbit_diagram(
    system: SectionSystem,
    over: str,
    values: Sequence[float] | Vector,
    *,
    direction: Annotated[str, Option("Of the sweep: up, down, both.")] = "up",
    start: Mapping[str, float] | Sequence[float] | None = None,
    starts: Annotated[
        int, Option("Of sweeps in each direction, all but one at random about the start.", minimum=1)
    ] = 1,
    transient: Annotated[int, Option("Steps at each value that are not kept.", minimum=0)] = 250,
    points: Annotated[int, Option("Points kept where a motion does not repeat itself.", minimum=1)] = 50,
    longest: int = 24,
    exponents: Annotated[
        int, Option("Draw largest exponents below, of runs of so many steps or more.", minimum=0, default="none")
    ] = 0,
    of: Annotated[str | None, Option(SHOWN, default="the first state", metavar="WHAT")] = None,
    branches: Annotated[
        int, Option("Lay branches of its motions over it, stable or not, to this period.", minimum=0, default="none")
    ] = 0,
    against_branches: Annotated[
        int, Option("Tell where a sweep left a stable branch, of motions to this period.", minimum=0, default="none")
    ] = 0,
    execution: Execution = IN_MEMORY,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> Diagram:
    """Show where motions stay over a parameter, swept up and down.

    Args:
        system: a map, or an oscillator at a section; of what nothing forces, given as it is, the maxima of a state.
        over, values: name of a parameter and its values (m,), ascending.
        direction: "up", "down" or "both".
        start: of each sweep, and anew where a run failed.
        starts: of sweeps in each direction: that one, and others at random within the sizes of the states about it,
            from which they may come to other motions. Sweeps in one direction are made side by side, each for less.
        transient: steps at each value before those that are kept.
        points: that are kept where a motion does not repeat itself.
        longest: period that is looked for.
        exponents: find the largest exponent also where no period is claimed, by a run of so many steps with a tangent,
            which is made longer, twice at most, where that does not tell its sign. 0 for none.
        of: what a picture shows: a state, the first if left out, or a quantity of a period, as "max(x)" (see
            ``fmu_models.sections.amounts``): of a motion that has one, else of each step.
        branches: follow the motions that are found, and all that leaves them, stable or not, up to periods of so many
            steps: branches laid over the diagram. 0 for none.
        against_branches: follow the motions that are found, up to periods of so many steps, and tell where a sweep left
            a stable branch that goes on; see ``lost_motions``. 0 for not.
        execution: Who makes the runs, and where they are kept.
        progress: called with the fraction done.

    Raises:
        StickslipError: an unknown name, values out of their range or not ascending, a direction that is none; as
            ``Execution``.
    """
    swept = np.asarray(values, dtype=float)
    if direction not in DIRECTIONS:
        raise StickslipError(f"The direction of a sweep is one of {', '.join(DIRECTIONS)}, found '{direction}'.")
    if swept.ndim != 1 or swept.size < 1 or not np.isfinite(swept).all() or (np.diff(swept) <= 0).any():
        raise StickslipError(f"The values of '{over}' must be finite and ascending, found shape {swept.shape}.")
    if min(points, starts) < 1 or min(transient, longest, branches) < 0:
        raise StickslipError(
            f"{starts} starts, {transient} steps of transient, {points} points, longest periods {longest} and "
            f"{branches}: take one start and one point at least, and none below 0."
        )
    if branches and (system.autonomous or not isinstance(system, Strobe | Iteration)):
        raise StickslipError(
            "Branches are laid over the diagram of a map, or of a strobe of what forces the motion; this is one of "
            f"{type(system).__name__}{', which nothing forces' if system.autonomous else ''}. Leave them out."
        )
    of = of or system.states[0]
    amount = shown_of(of, system)
    if isinstance(system, Strobe) and system.estimated:
        named = amount.names[0] if amount else of
        system = at_maxima(system, named if named in system.states else system.states[0])
    names = tuple(f"{way}_{k + 1}" if k else way for way in DIRECTIONS[direction] for k in range(starts))
    sweep = _Sweep(over, swept, names, _starts(system, start, starts), transient, points, longest, exponents)
    plan = {"analysis": "diagram", **vars(sweep)}
    with Runner(system, plan, execution, progress) as runner:
        result = _swept(runner, system, sweep, of)
        result = runner.finish(result if amount is None else _measured(system, result, amount))
    if branches:
        ends = (swept[0], swept[-1])
        result = replace(result, branches=branches_through(system, over, _motions(result), ends, branches, of))
    if against_branches:
        known = result.laid if branches >= against_branches else ()
        result = replace(result, lost=lost_motions(system, result, against_branches, known))
    return result


def _measured(system: Any, diagram: Diagram, amount: Amount) -> Diagram:
    """The diagram of a section of an FMU with a quantity of all its motions."""
    amounts, measured = np.full(diagram.points.shape[:-1], np.nan), Measured(system.fmu, amount, (), system.tolerance)
    for i, value in enumerate(diagram.values.tolist()):
        at = system.at(**{diagram.over: value})
        forcing = float(at.periods({}, 1)[0])
        for d in range(len(diagram.directions)):
            points = diagram.points[d, i][np.isfinite(diagram.points[d, i]).all(axis=1)]
            period = int(diagram.periods[d, i])
            if not len(points):
                continue
            times = at.step(points, derivative=False).times
            if period and period <= len(times):
                points, times = points[:1], times[:period].sum(keepdims=True)
            for k, (point, time) in enumerate(zip(points, times.tolist(), strict=True)):
                begin = at.begin(point, at.values, forcing).time
                amounts[d, i, k], _ = measured.of((begin, begin + time), at.as_run(point))
    units = system.units(*diagram.units)
    units[amount.label] = amount.unit(system.unit_of)
    return replace(diagram, amount=amount, amounts=amounts, units=units)


def _motions(diagram: Diagram) -> Iterator[Motion]:
    """The motions of which a period was claimed, of all sweeps."""
    for d, i in np.argwhere(diagram.periods > 0):
        yield float(diagram.values[i]), int(diagram.periods[d, i]), diagram.points[d, i, 0]


@dataclass(frozen=True, eq=False)
class _Sweep:
    over: str
    values: Vector
    directions: tuple[str, ...]
    start: Vector
    transient: int
    points: int
    longest: int
    exponents: int


def _starts(system: SectionSystem, start: Mapping[str, float] | Sequence[float] | None, count: int) -> Vector:
    """(count, n) the start, and others about it."""
    sizes = np.where(np.isfinite(system.sizes()) & system.free, system.sizes(), 0.0)
    apart = np.random.default_rng(0).uniform(-1.0, 1.0, (count, sizes.size))
    apart[0] = 0.0
    return system.wrapped(system.start(start) + sizes * apart)


def _swept(runner: Runner, system: SectionSystem, sweep: _Sweep, of: str) -> Diagram:
    directions, m, beside = sweep.directions, sweep.values.size, len(sweep.start)
    cells = np.arange(len(directions) * m).reshape(-1, m)
    cells = np.stack([row[:: 1 if name.startswith("up") else -1] for name, row in zip(directions, cells, strict=True)])
    order = cells.reshape(-1, beside, m).swapaxes(1, 2).ravel()  # of the cells, as they are made
    varied = {sweep.over: sweep.values[order % m]}
    starts, kept = np.tile(sweep.start[0], (order.size, 1)), max(sweep.points, 2 * sweep.longest)
    starts.reshape(-1, m, *sweep.start.shape)[:, 0] = sweep.start
    jobs = Jobs(starts, varied, sweep.transient, kept, chain=m, beside=beside, longest=sweep.longest, settled=SETTLED)
    rows = runner.make(jobs)
    claims = claimed(system, rows, varied, longest=sweep.longest)
    images = rows.points[:, : sweep.points].copy()
    began, growth = np.zeros((order.size, len(system.contacts)), np.int64), np.full(order.size, np.nan)
    lasted = np.full(order.size, np.nan)
    for cycles, indices in claims.parts:
        images[indices] = np.nan
        images[indices, : cycles.period] = cycles.points[:, : sweep.points]
        began[indices], lasted[indices] = cycles.began, cycles.times / cycles.period
        with np.errstate(divide="ignore"):
            growth[indices] = np.log(np.abs(cycles.eigenvalues[:, 0])) / cycles.period
    errors = np.where(np.isnan(growth), np.inf, 0.0)
    indices = np.flatnonzero((claims.periods == 0) & (rows.outcomes <= families.ABSORBED) & (rows.filled > 0))
    if sweep.exponents and indices.size:
        subset = {name: v[indices] for name, v in varied.items()}
        growth[indices], errors[indices], lasted[indices] = largest_exponents(
            runner, system, rows.ends[indices], subset, steps=sweep.exponents
        )
    inverse = np.argsort(order)

    def shaped(array: NDArray[Any]) -> NDArray[Any]:
        return array[inverse].reshape(len(directions), m, *array.shape[1:])

    bad = np.flatnonzero(rows.outcomes > families.ABSORBED).tolist()
    failures = {(directions[order[i] // m], float(sweep.values[order[i] % m])): families.reason(rows, i) for i in bad}
    units = system.units(*system.states, sweep.over)
    names = system.name, sweep.over, tuple(system.states), tuple(system.contacts)
    arrays = shaped(images), shaped(claims.periods), shaped(began), shaped(growth)
    origin = system.how, runner.provenance, units
    steps = int(rows.steps.sum())
    durations = {"durations": shaped(lasted), "unit": system.unit} if sweep.exponents else {}
    result = *names, sweep.values, directions, *arrays, failures, steps, of, *origin
    return Diagram(*result, exponent_errors=shaped(errors), **durations)


def _numbers(diagram: Diagram) -> list[tuple[float, dict[str, float]]]:
    rows = []
    lost = [motion.direction for motion in diagram.lost or ()]
    for i, value in enumerate(diagram.values.tolist()):
        values = special_values(diagram.branches.special) if diagram.branches and i == 0 else {}
        for d, direction in enumerate(diagram.directions):
            points = diagram.shown[d, i]
            if diagram.lost is not None and i == 0:
                values[f"lost_{direction}"] = float(lost.count(direction))
            values[f"period_{direction}"] = float(diagram.periods[d, i])
            if diagram.durations.size:
                values[f"exponent_{direction}"] = float(diagram.per_time[d, i])
            if np.isfinite(points).any():
                extremes = {"min": np.nanmin(points), "max": np.nanmax(points)}
                values |= {f"{diagram.of}_{name}_{direction}": float(extreme) for name, extreme in extremes.items()}
        rows.append((value, values))
    return rows


ANALYSIS = Analysis(
    function=orbit_diagram,
    numbers=_numbers,
    results=(
        "a row per value: `period_up`, `<state>_min_up`, `<state>_max_up`, and `_down`; with "
        "`starts` also `_up_2` and so on; with `exponents` also "
        "`exponent_up`, per unit of time; with `against_branches` the first row has `lost_up` and `lost_down`: how "
        "often a sweep left a stable branch that goes on; with `branches` it has what is special on them, as of "
        "`branch`: `fold_1`"
    ),
    example="discontinuous_support --forcing omega --set ks=300 --over omega=0.8:1:400 --figure d.png",
    label="sweeping",
    axes=VALUES,
)
