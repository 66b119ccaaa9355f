"""heyoka.py: Taylor series compiled by LLVM, with events as terminal events of the series' polynomials.

One integrator per mode, made once; from event to event Python decides. That decision, some ten microseconds, is part of
its time here: a script written for one model, with callbacks, does without (tests/benchmarks/bench_peers.py).

Source: Biscani and Izzo, Revisiting high-order Taylor methods for astrodynamics and celestial mechanics, Monthly
Notices of the Royal Astronomical Society 504 (2021).
"""

import importlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Literal, final

import numpy as np
import sympy

from fmu_models.language.quantities import TIME
from fmu_models.validation.methods.equations import Equations, Mode, Number, State
from fmu_models.validation.methods.result import (
    MethodProblem,
    MethodRun,
    NotInstalled,
    NotTreated,
    TooLong,
    needs_steady_inputs,
    timed,
)
from fmu_models.validation.methods.switching import Run

AGAIN = 1e-9  # of the run: a slip that ends so soon after it began has not begun


@final
@dataclass(frozen=True)
class HeyokaTaylor:
    """``extended``: in the 80 bits of a long double, for references, where the machine has them; ``most`` steps."""

    extended: bool = False
    most: int = 0  # no bound, as heyoka has it
    tolerances: tuple[float, ...] = (1e-6, 1e-9, 1e-12, 1e-15)
    family: Literal["event-driven"] = "event-driven"

    @property
    def name(self) -> str:
        return "heyoka.py" + (", long double" if self.extended else "")

    def prepare(self, problem: MethodProblem) -> Callable[[float], MethodRun]:
        """Make the integrators of the modes that a first run meets."""
        try:
            heyoka = importlib.import_module("heyoka")
        except ImportError:
            advice = "heyoka.py is not installed. Install the extra: pip install 'stickslip[bench]'."
            raise NotInstalled(advice) from None
        heyoka.set_logger_level_error()
        needs_steady_inputs(problem, self.name)
        for contact in problem.system.contacts:
            if contact.rooted:
                raise NotTreated(
                    f"'{contact.name}': a root of the depth has no Taylor series at entry. Use scipy with events."
                )
        equations = Equations(problem.system)
        run = Run(equations)
        steppers: dict[float, _HeyokaStepper] = {}

        def make(tolerance: float) -> MethodRun:
            def once() -> tuple[Any, tuple, int]:
                start = equations.start(problem.start)
                end = run.to(steppers[tolerance], start.astype(np.longdouble) if self.extended else start, stop)
                return end, tuple(run.switches), steppers[tolerance].evaluations

            stop: Any = np.longdouble(problem.stop_time) if self.extended else problem.stop_time
            if tolerance not in steppers:
                steppers[tolerance] = _HeyokaStepper(heyoka, run, tolerance, self.extended, self.most)
                once()
            steppers[tolerance].evaluations = steppers[tolerance].steps = 0
            return timed(once, equations.n)

        return make


def _converted(heyoka: ModuleType, expression: sympy.Basic, table: dict[Any, Any]) -> Any:
    """heyoka's expression; whole powers as products, since the series of a power of zero is not a number."""
    powers = [p for p in expression.atoms(sympy.Pow) if p.exp.is_Integer and 1 < p.exp < 10]
    if not powers:
        return heyoka.from_sympy(expression, table)
    converted = dict(table)
    placed = {}
    for power in powers:
        base = _converted(heyoka, power.base, table)
        placed[power] = sympy.Symbol(f"power{len(placed)}")
        converted[placed[power]] = math.prod([base] * (int(power.exp) - 1), start=base)
    return heyoka.from_sympy(expression.xreplace(placed), converted)


class _HeyokaStepper:
    def __init__(self, heyoka: ModuleType, run: Run, tolerance: float, extended: bool, most: int) -> None:
        self.heyoka, self.run, self.tolerance, self.extended, self.most = heyoka, run, tolerance, extended, most
        self.evaluations = self.steps = 0
        self._kept: dict[Mode, Any] = {}

    def _integrator(self, mode: Mode, n: int) -> Any:
        if mode in self._kept:
            return self._kept[mode]
        hy, equations = self.heyoka, self.run.equations
        names = [f"z{i}" for i in range(n)]
        variables = hy.make_vars(*names)
        variables = list(variables) if n > 1 else [variables]
        symbols = [sympy.Symbol(name) for name in names]
        plain = dict(zip(equations.symbols, symbols, strict=True)) | {TIME: sympy.Symbol("t")}
        table = dict(zip(symbols, variables, strict=True)) | {plain[TIME]: hy.time}

        def made(expression: sympy.Expr) -> object:
            return _converted(hy, sympy.sympify(expression).xreplace(plain), table)

        falling = hy.event_direction.negative
        options = {"fp_type": np.longdouble} if self.extended else {}
        events = [hy.t_event(made(w.expression), direction=falling, **options) for w in self.run.watches(mode)]
        right = [made(rate) for rate in equations.rates(mode)]
        zero = np.zeros(n, dtype=np.longdouble if self.extended else float)
        system = list(zip(variables, right, strict=True))
        tolerance = np.longdouble(self.tolerance) if self.extended else self.tolerance
        # without the high-accuracy switch rounding of the steps, not of the series, would be its error
        made_one = hy.taylor_adaptive(system, zero, t_events=events, tol=tolerance, high_accuracy=True, **options)
        self._kept[mode] = made_one
        return made_one

    def advance(self, mode: Mode, t: Number, z: State, stop: Number) -> tuple[Number, State, int | None]:
        if t >= stop:
            return t, z, None
        integrator = self._integrator(mode, len(z))
        integrator.time = t
        integrator.state[:] = z
        watched = self.run.watches(mode)
        if watched:
            integrator.reset_cooldowns()
        while True:
            budget = max(1, self.most - self.steps) if self.most else 0
            outcome, _, _, steps, _, _ = integrator.propagate_until(stop, max_steps=budget)
            if outcome == self.heyoka.taylor_outcome.step_limit:
                raise TooLong(f"heyoka.py takes more than {self.most} steps. Choose a shorter run.")
            self.steps += steps
            self.evaluations += steps * (integrator.order + 1)
            code = int(outcome)
            # a slip that has just been released starts at zero without acceleration: there rounding decides its sign
            fell = -code - 1
            released = code < 0 and fell < len(watched) and watched[fell].what == "slip"
            if not (released and integrator.time - t < AGAIN * stop):
                break
            # its slope is zero as well, and heyoka's pause after an event as long as its slope is small
            integrator.propagate_until(min(stop, t + AGAIN * stop))
            integrator.reset_cooldowns()
        if outcome == self.heyoka.taylor_outcome.time_limit:
            return stop, integrator.state.copy(), None
        if code < 0 and fell < len(watched):
            return integrator.time, integrator.state.copy(), fell
        raise NotTreated(f"heyoka.py stopped at {float(integrator.time):g} s: {outcome}.")
