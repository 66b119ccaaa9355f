"""scipy's integrators with its event location, one call of ``solve_ivp`` from event to event.

Events are sought where a function changes its sign between two steps: what happens twice within one step is missed.

Source: Virtanen et al., SciPy 1.0, Nature Methods 17 (2020); Hairer, Norsett, Wanner, Solving Ordinary Differential
Equations I (1993), for DOP853.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, final

import numpy as np
from scipy.integrate import solve_ivp

from fmu_models.base.arrays import Vector
from fmu_models.validation.methods.equations import Equations, Mode, Number, State
from fmu_models.validation.methods.result import (
    MethodProblem,
    MethodRun,
    NotTreated,
    TooLong,
    needs_steady_inputs,
    repeatable,
)
from fmu_models.validation.methods.switching import Run

FINEST = 2.3e-14  # scipy's smallest relative tolerance
_Function = Callable[[float, list[float]], list[float]]


@final
@dataclass(frozen=True)
class ScipyEvents:
    """``solver`` of solve_ivp; ``longest`` step in parts of the run, 1 for no bound; ``most`` right-hand sides."""

    solver: Literal["DOP853", "RK45", "Radau", "LSODA"] = "DOP853"
    longest: float = 1.0
    most: float = np.inf
    tolerances: tuple[float, ...] = (1e-6, 1e-8, 1e-10, 1e-12)
    family: Literal["event-driven"] = "event-driven"

    @property
    def name(self) -> str:
        return f"scipy {self.solver} with events"

    def prepare(self, problem: MethodProblem) -> Callable[[float], MethodRun]:
        """Compile nothing yet: fields are made as modes appear, in a first run."""
        needs_steady_inputs(problem, self.name)
        equations = Equations(problem.system)
        run = Run(equations)
        stepper = _ScipyStepper(run, self.solver, problem, self.longest, self.most)

        def once(tolerance: float) -> tuple[Any, tuple, int]:
            stepper.begin(tolerance)
            end = run.to(stepper, equations.start(problem.start), problem.stop_time)
            return end, tuple(run.switches), stepper.evaluations

        return repeatable(once, equations.n)


class _ScipyStepper:
    def __init__(self, run: Run, solver: str, problem: MethodProblem, longest: float, most: float) -> None:
        self.run, self.solver, self.problem, self.most = run, solver, problem, most
        self.longest = longest * problem.stop_time if longest < 1.0 else np.inf
        self.evaluations = self.called = 0
        self._kept: dict[Mode, tuple[Any, list[Any]]] = {}

    def begin(self, tolerance: float) -> None:
        self.evaluations = self.called = 0
        self.rtol = max(tolerance, FINEST)
        extended = len(self.run.equations.symbols) - self.problem.start.size
        self.atol = np.concatenate([tolerance * self.problem.nominal, np.ones(extended)])

    def _functions(self, mode: Mode) -> tuple[Any, list[Any]]:
        if mode not in self._kept:
            events = []
            for watch in self.run.watches(mode):
                value = self.run.equations.function([watch.expression])

                def event(t: float, z: Vector, value: _Function = value) -> float:
                    return value(t, z.tolist())[0]

                event.terminal, event.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
                events.append(event)
            field = self.run.equations.field(mode)
            rates = self._counted(field) if self.most < np.inf else lambda t, z: field(t, z.tolist())
            self._kept[mode] = rates, events
        return self._kept[mode]

    def _counted(self, field: _Function) -> Callable[[float, Vector], list[float]]:
        """A right-hand side that gives up."""

        def counted(t: float, z: Vector) -> list[float]:
            self.called += 1
            if self.called > self.most:
                raise TooLong(f"{self.solver} takes more than {self.most:g} right-hand sides. Choose a shorter run.")
            return field(t, z.tolist())

        return counted

    def advance(self, mode: Mode, t: Number, z: State, stop: Number) -> tuple[Number, State, int | None]:
        if t >= stop:
            return t, z, None
        field, events = self._functions(mode)
        solution = solve_ivp(
            *(field, (t, stop), z),
            method=self.solver, events=events, rtol=self.rtol, atol=self.atol, max_step=self.longest,
        )  # fmt: skip
        self.evaluations += solution.nfev
        if solution.status < 0:
            raise NotTreated(f"{self.solver} stopped at {solution.t[-1]:g} s: {solution.message}")
        if solution.status == 0:
            return stop, solution.y[:, -1], None
        fell = next(i for i, times in enumerate(solution.t_events) if len(times))
        return float(solution.t_events[fell][0]), solution.y_events[fell][0].copy(), fell
