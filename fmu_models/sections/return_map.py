"""Return maps: where a motion that starts on a section meets it again, as a function of one number.

    x -> start(x) -> motion -> first accepted crossing of the section -> value of the state x there

The map of a mechanism with impacts jumps where two events change their order, and has no value where the motion does
not return; ``crossings.find_crossings`` tells its fixed points and jumps apart. Its slope is exact: with D the
derivative of the flow up to the time of the crossing, s the direction of the start and q the state that names the
section,

    slope = (D s)_x - x' (D s)_q / q'
"""

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np

from fmu_models.base.arrays import Varied, Vector
from fmu_models.base.errors import StickslipError
from fmu_models.families.stepwise import Step
from fmu_models.fmu.fmu import Fmu
from fmu_models.sections.system import SectionSystem, named_point
from fmu_models.simulation.run import check_names, check_value
from fmu_models.simulation.sections import Section, SectionFollower, SectionPoint
from fmu_models.simulation.sensitivity import flow_derivative

Start = Mapping[str, float] | Callable[[float], Mapping[str, float]]


class _Own(threading.local):
    """What each thread has for itself: an instance that it follows, and the map at the values asked for last."""

    def __init__(self, fmu: Fmu, section: Section, run: Mapping[str, Any]) -> None:
        self.follower = SectionFollower(fmu, section, **run)
        self.latest: tuple[Mapping[str, float], Any] | None = None


class ReturnMap(SectionSystem):
    """A function of the value of one state, nan where the motion does not return in time.

    As a section system its points have one number, so that all analyses take it too.

    Attributes:
        fmu: the model; in each thread one instance of it makes all the motions.
        state: name of the state that is mapped.
        section: where the motion returns.
        cap: s, the time after which a motion counts as one that does not return.
    """

    def __init__(
        self,
        fmu: Fmu,
        state: str,
        *,
        section: Section,
        cap: float,
        start: Start | None = None,
        accept: Callable[[SectionPoint], bool] | Mapping[str, float] | None = None,
        parameters: Mapping[str, float] | None = None,
        inputs: Mapping[str, float] | None = None,
        tolerance: float = 1e-14,
    ) -> None:
        """Define the map.

        Args:
            start: the other states at the start; or all that differ from the defaults as a function of the state.
            accept: whether a crossing belongs to the map, as a function or as states of contacts there, by name; the
                motion goes on from one that does not.
            parameters, inputs, tolerance: as for ``sections.crossings``.

        Raises:
            StickslipError: an unknown name, a value out of its range, a cap that is no time.
        """
        if not (math.isfinite(cap) and cap > 0):
            raise StickslipError(f"The cap on the time of return must be a positive number of seconds, found {cap:g}.")
        check_names(fmu, "state", {state: None}, fmu.states)
        self.fmu, self.state, self.section, self.cap = fmu, state, section, cap
        self._start = {} if start is None else start
        self._accept: Callable[[SectionPoint], bool] | dict[str, float]
        if callable(accept):
            self._accept = accept
        else:
            self._accept = dict(accept or {})
            check_names(fmu, "contact", self._accept, fmu.contacts)
        constants = {"parameters": dict(parameters or {}), "inputs": dict(inputs or {})}
        self._run: dict[str, Any] = {**constants, "tolerance": tolerance}
        self._own = _Own(fmu, section, self._run)
        self.values = {**self._run["parameters"], **self._run["inputs"]}

    @property
    def name(self) -> str:
        return str(self.fmu.description.modelName)

    @property
    def states(self) -> tuple[str, ...]:
        """The state that is mapped."""
        return (self.state,)

    @property
    def parameters(self) -> Sequence[str]:
        """Parameters and inputs."""
        return [*self.fmu.parameters, *self.fmu.inputs]

    def at(self, **values: float) -> Self:
        """The map at other values of parameters and inputs."""
        if self._own.latest and self._own.latest[0] == values:  # as iterates and searches ask, again and again
            return self._own.latest[1]
        check_names(self.fmu, "parameter", values, self.parameters)
        run: dict[str, Any] = dict(self._run)
        for kind, changed in self.fmu.settings(values).items():
            run[kind] = {**run[kind], **{name: float(value) for name, value in changed.items()}}
        how: dict[str, Any] = {"section": self.section, "cap": self.cap, "start": self._start, "accept": self._accept}
        system = type(self)(self.fmu, self.state, **how, **run)
        self._own.latest = values, system
        return system

    def identity(self) -> dict[str, Any]:
        """The identity with the section, the start, and the FMU's token and hash."""
        if callable(self._start) or callable(self._accept):
            raise StickslipError(
                "A store says what it is made of, and a function has no name that tells it from others: give the start "
                "of the return map as values, and accept as states of contacts."
            )
        section = {"section": [self.section.state, self.section.level, self.section.direction]}
        fmu = {"token": str(self.fmu.description.guid), "sha256": self.fmu.sha256}
        given = {"start": dict(self._start), "accept": self._accept, "tolerance": self._run["tolerance"]}
        return {**super().identity(), **section, **fmu, **given}

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_own"}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        vars(self).update(state)
        self._own = _Own(self.fmu, self.section, self._run)

    def check(self, name: str, values: Vector) -> None:
        """Raises StickslipError: no such parameter or input, or a value out of its range."""
        check_names(self.fmu, "parameter", {name: None}, self.parameters)
        for value in (np.min(values), np.max(values)):
            check_value(self.fmu, name, float(value))

    def start(self, values: Mapping[str, float] | Sequence[float] | None = None) -> Vector:
        """(1,) a value of the state; what is said of the others must be what the map has."""
        if isinstance(values, Mapping) and not callable(self._start):
            values = {name: v for name, v in values.items() if name == self.state or self._start.get(name) != v}
        return named_point(self.name, self.states, np.array([self.fmu.start_of(self.state)]), values)

    def sizes(self) -> Vector:
        """(1,) nominal value of the state."""
        return np.array([self.fmu.size_of(self.state)])

    def step(self, points: Vector, varied: Varied | None = None, *, derivative: bool = True) -> Step:
        """One return of points (m, 1), one after the other."""
        m = len(points)
        after, slopes, times = np.full((m, 1), np.nan), np.full((m, 1, 1), np.nan), np.full(m, np.nan)
        why: dict[int, str] = {}
        for i, x in enumerate(points[:, 0].tolist()):
            system = self.at(**{name: float(v[i]) for name, v in varied.items()}) if varied else self
            try:
                crossing = system.crossing(x)
                slopes[i] = system.slope(x) if derivative and crossing is not None else np.nan
            except StickslipError as error:
                why[i] = str(error)
                continue
            if crossing is None:
                why[i] = f"the motion does not return within {self.cap:g} s"
            else:
                after[i, 0], times[i] = crossing.states[self.state], crossing.time
        return Step.without_contacts(after, slopes, times, why)

    def _contents(self) -> dict[str, object]:
        return {"model": self.fmu.description.modelName, "state": self.state, "section": self.section, "cap": self.cap}

    def __call__(self, x: float) -> float:
        """The value of the state at the return, in its unit; nan if there is none within the cap. StickslipError: a
        start out of its range, or a motion that the engine cannot continue."""
        crossing = self.crossing(x)
        return math.nan if crossing is None else crossing.states[self.state]

    def states_at(self, x: float) -> dict[str, float]:
        """The states at the start for a value of the state; those left out have their defaults."""
        if callable(self._start):
            return dict(self._start(float(x)))
        return {**self._start, self.state: float(x)}

    def crossing(self, x: float) -> SectionPoint | None:
        """The return itself, or None."""
        for passage in self._own.follower.follow(self.states_at(x), self.cap):
            if self._accepts(passage):
                return passage
        return None

    def _accepts(self, passage: SectionPoint) -> bool:
        if callable(self._accept):
            return self._accept(passage)
        return all(passage.contacts[name] == state for name, state in self._accept.items())

    def slope(self, x: float) -> float:
        """Derivative of the map, through all events; nan where there is no return.

        Raises:
            StickslipError: as for a value; or the motion touches the bound of a contact without crossing it.
        """
        crossing = self.crossing(x)
        if crossing is None:
            return math.nan
        flow = flow_derivative(self.fmu, crossing.time, start=self.states_at(x), **self._run)
        change = dict(zip(flow.states, (flow.by_start @ self._direction(x, flow.states)).tolist(), strict=True))
        later = change[self.section.state] / crossing.rates[self.section.state]
        return change[self.state] - crossing.rates[self.state] * later

    def _direction(self, x: float, names: Sequence[str]) -> np.ndarray:
        """(n,) derivative of the start values by x; from differences where they are a function."""
        if not callable(self._start):
            return np.array([float(name == self.state) for name in names])
        h = 1e-5 * max(1.0, abs(x))
        over, below = self.states_at(x + h), self.states_at(x - h)
        return np.array([(over[name] - below[name]) / (2 * h) if name in over else 0.0 for name in names])
