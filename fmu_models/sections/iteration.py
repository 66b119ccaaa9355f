"""A declared map with numbers for its parameters, so that it can be iterated: a system whose every step is a section.

Steps by the handful are NumPy's, families of runs the engine's, by the same rule compiled (engine/ensemble/map_runs.c).
"""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Self

import numpy as np
import sympy
from numpy.typing import ArrayLike, NDArray

from fmu_models.base.arrays import Varied, Vector
from fmu_models.base.cache import digest
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.codegen.package import built_of
from fmu_models.families.jobs import Jobs
from fmu_models.families.stepwise import FAR, Step
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.maps import Map
from fmu_models.language.values import check_numbers, check_values
from fmu_models.lowering.iterated import differentiated, iterated_alone
from fmu_models.sections.diagonal import Crossings, find_crossings
from fmu_models.sections.system import SectionSystem, named_point
from fmu_models.simulation.engine import engine_of
from fmu_models.simulation.ensemble import KINDS, EnsembleRuns, Where, make_runs
from fmu_models.simulation.rows import RunRows, joined


@dataclass(frozen=True, eq=False)
class Iteration(SectionSystem):
    """A map with numbers for its parameters.

    Attributes:
        map: the declaration.
        values: of all parameters, by name.
        backward: the negative map, which is the inverse of the declared one.
    """

    map: Map
    values: Mapping[str, float] = field(default_factory=dict)
    backward: bool = False
    unit = "1"
    together = 1
    pace = 200

    def __post_init__(self) -> None:
        """Raises StickslipError: values that are not those of the map's parameters."""
        names = [parameter.name for parameter in self.map.parameters]
        check_numbers(self.map, self.values)
        if missing := [name for name in names if name not in self.values]:
            raise StickslipError(
                f"{self.name} has no value for its parameter '{missing[0]}'; Iteration.of(map, values) takes "
                "defaults of what is not named."
            )
        # in the order of the declaration, in which the compiled functions take them
        object.__setattr__(self, "values", {name: float(self.values[name]) for name in names})

    @classmethod
    def of(cls, declared: Map, values: Mapping[str, float] | None = None, *, backward: bool = False) -> Iteration:
        """The map at these values; parameters not named keep their defaults.

        Raises:
            StickslipError: a value that the map cannot have, or no inverse to go backward by.
        """
        parameters = values or {}
        check_values(declared, parameters)
        if backward and declared.inverse is None:
            raise StickslipError(
                f"{declared.name} has no inverse: several states lead to the same one, or the declaration does not say "
                "which does. Only the positive map can be followed."
            )
        numbers = {p.name: float(parameters.get(p.name, p.value)) for p in declared.parameters}
        iteration = cls(declared, numbers, backward)
        if backward and np.isnan(iteration(np.array([state.start for state in declared.states]))).any():
            listing = ", ".join(f"{name} = {value:g}" for name, value in iteration.values.items())
            raise StickslipError(
                f"{declared.name} has no inverse at {listing}: its formula has no value there. Choose other "
                "parameters, or follow the positive map."
            )
        return iteration

    @property
    def name(self) -> str:
        """Name of the map."""
        return self.map.name

    def unit_of(self, name: str) -> str:
        quantities = (*self.map.states, *self.map.parameters)
        return next((quantity.unit for quantity in quantities if quantity.name == name), "1")

    def description_of(self, name: str) -> str:
        quantities = (*self.map.states, *self.map.parameters)
        return next((quantity.description for quantity in quantities if quantity.name == name), "")

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return tuple(state.name for state in self.map.states)

    @property
    def parameters(self) -> Sequence[str]:
        """Names of the parameters."""
        return list(self.values)

    def at(self, **values: float) -> Self:
        """The map at other values; errors as for ``of``."""
        for name in values:
            self._check_name(name)
        check_values(self.map, {**self.values, **values})
        return dataclasses.replace(self, values={**self.values, **{name: float(v) for name, v in values.items()}})

    def check(self, name: str, values: Vector) -> None:
        """Raises StickslipError: no such parameter, or a value that it cannot have."""
        self._check_name(name)
        for value in values:
            check_values(self.map, {**self.values, name: float(value)})

    def _check_name(self, name: str) -> None:
        refuse_unknown(name, self.values, f"{self.name} has no parameter '{name}'.")

    def start(self, values: Mapping[str, float] | Sequence[float] | None = None) -> Vector:
        """(n,) a state; what is not given is as declared."""
        return named_point(self.name, self.states, np.array([float(x.start) for x in self.map.states]), values)

    def identity(self) -> dict[str, Any]:
        """The identity with the hash of the rule."""
        rule = (self.map.inverse if self.backward else self.map.rule) or {}
        return {**super().identity(), "rule": digest(*(str(rule[x]) for x in self.map.states))}

    @property
    def box(self) -> Vector:
        """(n, 2) range of each state in which motions are sought."""
        return np.array([self.map.box[state] for state in self.map.states])

    def sizes(self) -> Vector:
        """(n,) sizes of the box."""
        return self.box[:, 1] - self.box[:, 0]

    def step(self, points: Vector, varied: Varied | None = None, *, derivative: bool = True) -> Step:
        """One step of points (m, n), angles within their modulus."""
        x, n = np.asarray(points, dtype=float), len(self.states) if derivative else 0
        values = [np.asarray({**self.values, **(varied or {})}[name]) for name in self.values]
        after = self._evaluated(0, x, values)
        slopes = (self._evaluated(1, x, values) if derivative else np.empty(0)).reshape(len(x), n, n)
        why = dict.fromkeys(np.flatnonzero(np.isnan(after).any(axis=1)).tolist(), "the rule has no value there")
        return Step.without_contacts(self.wrapped(after), slopes, np.ones(len(x)), why)

    def run(self, jobs: Jobs, stop: NDArray[np.int32]) -> RunRows:
        """The rows of some jobs, by the compiled rule; ends soon where ``stop`` (1,) is set."""
        if jobs.chain > 1 and len(jobs) > jobs.block:
            begins = range(0, len(jobs), jobs.block)
            return joined([self.run(jobs.part(i, i + jobs.block), stop) for i in begins], begins)
        fmu = _fmu(self.map, self.backward)
        m, n = jobs.starts.shape
        constants = {name: np.full(m, value) for name, value in self.values.items()} | dict(jobs.varied)
        runs = EnsembleRuns(
            references=[fmu.variables[name].valueReference for name in (*constants, *self.states)],
            values=np.stack([*constants.values(), *jobs.starts.T], axis=1),
            **{name: np.zeros(m) for name in ("starts", "periods", "patience")},
            weights=np.append(1.0 / self.sizes(), 0.0),
            turns=self.turns,
            bound=FAR,
            known=jobs.targets,
            along=range(n if jobs.derivatives else jobs.tangents),
            **jobs.settings,
        )
        rows = make_runs(engine_of(fmu), (n, 0), Where(KINDS.STEP), runs, stop)
        return replace(rows, points=rows.points[..., :n], derivatives=rows.derivatives[:, :, :n])

    def log_volumes(self, points: Vector) -> Vector:
        with np.errstate(divide="ignore"):  # where a step flattens volumes, -inf is right
            return np.log(np.abs(self.determinant(points)))

    def __call__(self, x: ArrayLike) -> Vector:
        """(..., n) next states, angles within their modulus; nan where there is none."""
        return self.wrapped(self.lifted(x))

    def lifted(self, x: ArrayLike) -> Vector:
        """(..., n) next states without taking remainders."""
        return self._evaluated(0, x)

    def jacobian(self, x: ArrayLike) -> Vector:
        """(..., n, n) derivative of the next states."""
        return self._evaluated(1, x).reshape(*np.shape(x), np.shape(x)[-1])

    def determinant(self, x: ArrayLike) -> Vector:
        """(...) determinant of the derivative, by which small areas or volumes grow; cancelled by SymPy beforehand."""
        return self._evaluated(2, x)[..., 0]

    def _evaluated(self, part: int, points: ArrayLike, values: Sequence[Any] | None = None) -> Vector:
        """(..., k) a part of ``_functions``, at the values of the parameters if no others are given."""
        x, function = np.asarray(points, dtype=float), _functions(self.map, self.backward)[part]
        with np.errstate(all="ignore"):
            components = function(*np.moveaxis(x, -1, 0), *(self.values.values() if values is None else values))
        rows = [np.broadcast_to(np.asarray(component, dtype=float), x.shape[:-1]) for component in components]
        stacked = np.stack(rows, axis=-1)
        return np.where(np.isfinite(stacked), stacked, np.nan)

    @property
    def driven(self) -> list[int]:
        """Angles that each step turns by the same."""
        turned = {x: self.map.rule[x] - x for x in self.map.modulus}
        return [self.map.states.index(x) for x, by in turned.items() if not by.free_symbols & set(self.map.states)]

    @property
    def turns(self) -> Vector:
        """Moduli of the states."""
        return _moduli(self.map)


def iterate(iteration: Iteration, start: ArrayLike, steps: int) -> Vector:
    """(steps + 1, ..., n) states from ``start`` (..., n); nan from where the motion leaves every bound."""
    states = [np.asarray(start, dtype=float)]
    for _ in range(steps):
        states.append(iteration(states[-1]))
    return np.stack(states)


def find_iterate_crossings(
    iteration: Iteration, period: int = 1, *, box: ArrayLike | None = None, **search: Any
) -> Crossings:
    """Fixed points and jumps of the n-th iterate of a map of one variable, told apart.

    Args:
        iteration: the map.
        period: n.
        box: (1, 2) range; that of the declaration if left out.
        search: samples, resolution, accuracy, noise of ``find_crossings``.

    Raises:
        StickslipError: more than one state, or an angle, whose rule jumps wherever it is wrapped.
    """
    if len(iteration.states) != 1 or iteration.map.modulus:
        raise StickslipError(
            f"{iteration.map.name} has the states {', '.join(iteration.states)}: crossings with the diagonal are those "
            "of a map of one variable that is no angle. Look for its periodic motions."
        )
    bounds = iteration.box if box is None else np.asarray(box, dtype=float)

    def points(x: float) -> Vector:
        return iterate(iteration, [x], period)[:, 0]

    def slope(x: float) -> float:
        return float(np.prod(iteration.jacobian(points(x)[:-1, None])))

    search, (low, high) = {"samples": min(200 * period, 2000)} | search, bounds[0].tolist()
    return find_crossings(lambda x: float(points(x)[-1]), low, high, slope=slope, **search)


@cache
def _functions(declared: Map, backward: bool) -> tuple[Any, Any, Any]:
    """The next states, their derivatives row by row, and their determinant, of states and parameters."""
    rule = (declared.inverse if backward else declared.rule) or {}
    ordered = {x: rule[x] for x in declared.states}
    entries, determinant = differentiated(ordered)
    arguments, expressions = [*declared.states, *declared.parameters], (list(ordered.values()), entries, [determinant])
    states, derivatives, volume = (sympy.lambdify(arguments, e, "numpy", cse=True) for e in expressions)
    return states, derivatives, volume


def _fmu(declared: Map, backward: bool) -> Fmu:
    """The FMU of the map; once for all threads."""
    with _building:
        return _built(declared, backward)


@cache
def _built(declared: Map, backward: bool) -> Fmu:
    return Fmu.open(built_of(iterated_alone(declared, backward)))


_building = threading.Lock()


@cache
def _moduli(declared: Map) -> Vector:
    """(n,) modulus of each state; infinite for those that are no angles."""
    return np.array([float(declared.modulus.get(state, sympy.oo)) for state in declared.states])
