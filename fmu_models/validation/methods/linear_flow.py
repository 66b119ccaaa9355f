"""Closed form of piecewise linear systems: matrix exponentials from event to event, in as many digits as wanted.

    z' = A z,    z(t + s) = exp(A s) z(t)

z the states, cosine and sine of every harmonic force, the time and 1. A system whose field is affine in the states in
every mode, driven by harmonics and ramps, is exactly this; only event times are found by iteration, to all digits. It
needs no periodic or particular solutions, so that resonance and vanishing damping are no special cases.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, final

import mpmath
import sympy
from sympy.solvers.solveset import NonlinearError

from fmu_models.language.quantities import TIME
from fmu_models.validation.methods.equations import Equations, Mode, Number, State
from fmu_models.validation.methods.result import (
    MethodProblem,
    MethodRun,
    NotTreated,
    TooLong,
    needs_steady_inputs,
    timed,
)
from fmu_models.validation.methods.switching import Run

if TYPE_CHECKING:
    from mpmath.matrices.matrices import _matrix

DIGITS = 40
LOOK = 0.05  # of the shortest time constant: events are looked for this often, and at every minimum
# products of the matrix for a run, some ten seconds: other references are there for longer ones. Counted, not timed, so
# that it does not depend on the machine and its load what a comparison is measured against
MOST = 100_000
SEEN = 10_000  # products after which a run is given up that at its pace would take more
NAME = "closed form, piecewise linear"
_Look: TypeAlias = "tuple[_matrix, list[Any]]"


@final
@dataclass(frozen=True)
class LinearFlow:
    """Exact flow; its tolerances have no meaning."""

    name: str = NAME
    family: Literal["event-driven"] = "event-driven"
    tolerances: tuple[float, ...] = (1e-30,)

    def prepare(self, problem: MethodProblem) -> Callable[[float], MethodRun]:
        """Refuse what is not piecewise linear; modes are looked at as they appear."""
        needs_steady_inputs(problem, self.name)
        equations = Equations(problem.system)
        if any(c.rooted for c in equations.contacts):
            raise NotTreated(f"{NAME}: a force is not linear in the depth. Use event-driven Taylor.")

        def make(_: float) -> MethodRun:
            with mpmath.workdps(DIGITS):
                run = Run(_Exact(equations.system), "mpmath")
                start = [mpmath.mpf(float(x)) for x in equations.start(problem.start)]
                stepper = _LinearStepper(run)

                def once() -> tuple[Any, tuple, int]:
                    end = run.to(stepper, start, mpmath.mpf(problem.stop_time))
                    return end, tuple(run.switches), stepper.evaluations

                return timed(once, equations.n)

        return make


class _Exact(Equations):
    """Equations whose numbers are exact fractions, so that they do not lose digits on the way through text."""

    def function(self, expressions: Sequence[Any], modules: str = "math") -> Callable[[Number, Any], list[Any]]:
        exact = [_rational(sympy.sympify(e)) for e in expressions]
        return super().function(exact, modules)


def _rational(expression: sympy.Basic) -> sympy.Basic:
    return expression.xreplace({f: sympy.Rational(f) for f in expression.atoms(sympy.Float)})


class _LinearStepper:
    def __init__(self, run: Run) -> None:
        self.run = run
        self.evaluations = 0
        self._modes: dict[Mode, _Linear] = {}
        self._last: Any = 0

    def advance(self, mode: Mode, t: Number, z: State, stop: Number) -> tuple[Number, State, int | None]:
        if mode not in self._modes:
            self._modes[mode] = _Linear(self.run, mode)
        flow = self._modes[mode]
        x = flow.lift(t, z)
        values = flow.watched(t, z)
        before: _Look | None = None  # state and values one look back
        # small bounces follow small ones: the first look comes well before the last interval is over
        h = min(flow.look, stop, 16 * (t - self._last) if t > self._last else flow.look) / 64
        self._last = t
        while t < stop:
            self.evaluations += 1
            work = sum(flow.products for flow in self._modes.values())
            if work > SEEN and work * stop > MOST * t:
                raise TooLong(f"{NAME}: the run is too long for {DIGITS} digits. Use event-driven Taylor.")
            full_look = h >= flow.look and t + flow.look <= stop
            step = flow.look if full_look else min(h, stop - t)
            new = flow.looked(x) if full_look else at(flow.series(x, step), step)
            seen = flow.watched(t + step, flow.states(new))
            fallen = [i for i, (a, b) in enumerate(zip(values, seen, strict=True)) if a >= 0 > b]
            if fallen:
                series = flow.series(x, step)
                s, i = min((flow.root(i, t, series, mpmath.mpf(0), step), i) for i in fallen)
                return t + s, flow.states(at(series, s)), i
            dipped = self._dip(flow, t, before, x, values, seen, step) if before is not None else None
            if dipped is not None:
                s, i = dipped
                return t + s, flow.states(at(flow.series(x, s), s)), i
            before = x, values
            t, x, values = t + step, new, seen
            h *= 2
        return stop, flow.states(x), None

    def _dip(
        self, flow: _Linear, t: Number, before: _Look, x: _matrix, slope: list[Any], then: list[Any],
        step: Number,
    ) -> tuple[Number, int] | None:  # fmt: skip
        """The first zero of a function that is lowest near t and below zero there, but nowhere it was looked at."""
        dips = []
        series: list[_matrix] = []
        for i, (a, b, c) in enumerate(zip(before[1], slope, then, strict=True)):
            curvature = a - 2 * b + c
            if not (a > b <= c and b > 0 and curvature > 0 and b < 8 * curvature):
                continue
            series = series or flow.series(x, step)
            low, high = -step, step  # golden section; the look before may have been shorter, the flow runs back as well
            for _ in range(60):
                lower, two = low + 0.382 * (high - low), low + 0.618 * (high - low)
                if flow.value(i, t, series, lower) < flow.value(i, t, series, two):
                    high = two
                else:
                    low = lower
            if flow.value(i, t, series, low) < 0:
                dips.append((flow.root(i, t, series, -step, low), i))
        return min(dips) if dips else None


class _Linear:
    """One mode: its matrix, and what is watched."""

    def __init__(self, run: Run, mode: Mode) -> None:
        equations = run.equations
        self.n = len(equations.symbols)
        rates = [_rational(sympy.expand(sympy.sympify(r))) for r in equations.rates(mode)]
        waves = sorted({_argument(w) for r in rates for w in r.atoms(sympy.sin, sympy.cos)}, key=str)
        self._waves = [sympy.lambdify([TIME], w, "mpmath") for w in waves]
        pairs = [(sympy.Dummy("c"), sympy.Dummy("s")) for _ in waves]
        clock = sympy.Dummy("clock")
        substitutions = {sympy.cos(w): c for w, (c, _) in zip(waves, pairs, strict=True)}
        substitutions |= {sympy.sin(w): s for w, (_, s) in zip(waves, pairs, strict=True)}
        rates = [r.xreplace(substitutions).xreplace({TIME: clock}) for r in rates]
        for w, (c, s) in zip(waves, pairs, strict=True):
            speed = sympy.diff(w, TIME)
            rates += [-speed * s, speed * c]
        unknowns = [*equations.symbols, *(symbol for pair in pairs for symbol in pair), clock]
        try:
            matrix, constant = sympy.linear_eq_to_matrix([*rates, sympy.S.One], unknowns)
        except NonlinearError:
            raise NotTreated(f"{NAME}: the field is not linear in some mode. Use event-driven Taylor.") from None
        size = len(unknowns) + 1
        A = mpmath.zeros(size)
        for i in range(size - 1):
            for j in range(size - 1):
                A[i, j] = _number(matrix[i, j])
            A[i, size - 1] = -_number(constant[i])
        self.A = A
        self.products = 0
        largest = max(abs(value) for value in mpmath.eig(A, left=False, right=False)) or mpmath.mpf(1)
        self.look = LOOK / largest
        self.step = mpmath.expm(A * self.look, method="taylor")
        self._watch = equations.function([w.expression for w in run.watches(mode)], "mpmath")

    def lift(self, t: Number, z: State) -> _matrix:
        """The extended state."""
        arguments = [wave(t) for wave in self._waves]
        waves = [f(a) for a in arguments for f in (mpmath.cos, mpmath.sin)]
        return mpmath.matrix([*z, *waves, t, 1])

    def states(self, x: _matrix) -> list[Any]:
        """z from the extended state."""
        return [x[i] for i in range(self.n)]

    def watched(self, t: Number, z: State) -> list[Any]:
        """Values of the watched functions."""
        return self._watch(t, z)

    def looked(self, x: _matrix) -> _matrix:
        """The state one look later."""
        self.products += 1
        return self.step * x

    def series(self, x: _matrix, reach: Number) -> list[_matrix]:
        """Terms of exp(A s) x, for any s up to ``reach`` in either direction."""
        terms, power = [x], mpmath.mpf(1)
        for k in range(1, 200):
            self.products += 1
            terms.append(self.A * terms[-1] / k)
            power *= reach
            if mpmath.norm(terms[-1], mpmath.inf) * abs(power) <= mpmath.eps * mpmath.norm(x, mpmath.inf):
                break
        return terms

    def value(self, i: int, t: Number, series: list[_matrix], s: Number) -> Number:
        """One watched function at t + s."""
        return self.watched(t + s, self.states(at(series, s)))[i]

    def root(self, i: int, t: Number, series: list[_matrix], low: Number, high: Number) -> Number:
        """Where a watched function falls to zero between t + low and t + high."""
        if self.value(i, t, series, low) <= 0:
            return low
        tolerance = mpmath.mpf(10) ** (-2 * DIGITS + 10)
        return mpmath.findroot(
            lambda s: self.value(i, t, series, s),
            (low, high),
            solver="anderson",
            tol=tolerance,
            maxsteps=200,
            verify=False,
        )


def at(series: list[_matrix], s: Number) -> _matrix:
    """The sum of a series at s."""
    total = series[-1]
    for term in reversed(series[:-1]):
        total = total * s + term
    return total


def _argument(wave: sympy.Expr) -> sympy.Basic:
    """Argument of a sine or cosine, if it is a multiple of the time and a phase."""
    argument = wave.args[0]
    if argument.free_symbols - {TIME} or sympy.diff(argument, TIME, 2) != 0:
        raise NotTreated(f"{NAME}: {wave} is no harmonic of the time. Use event-driven Taylor.")
    return argument


def _number(value: object) -> Number:
    """A constant in all digits."""
    exact = sympy.sympify(value)
    if exact.free_symbols:
        raise NotTreated(f"{NAME}: a coefficient changes with time. Use event-driven Taylor.")
    return (
        mpmath.mpf(exact.p) / exact.q if isinstance(exact, sympy.Rational) else mpmath.mpf(str(sympy.N(exact, DIGITS)))
    )
