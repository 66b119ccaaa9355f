"""Switch model of Leine and van Campen: a smooth system on every side, and a band |h| <= eta around each boundary.

    friction, sliding switch, boundary y = 0
        |y| > eta                    slip with the sign of y
        |y| <= eta, G+ < 0 < G-      stick: Filippov's mean of both fields, led to the middle: y' = -sqrt(k/m) y
        |y| <= eta otherwise         transition: the field of the side that the motion goes to
    stop, boundaries depth = 0 (m) and, if it lets go by force, F = 0 (N); switch without sliding, h = 0
        inside or outside the band   the field of the side
        in the band                  crossing: the mean of both fields

with G the rate of y, grad y . f, by the fields on both sides; G+ < 0 < G- is the same as |lambda| < capacity. For k/m
stands the largest stiffness over mass that the accelerations have at the start. RKF45 integrates all of it as ordinary
equations. ``frozen`` decides the mode once per step rather than for every stage: the step then goes on beyond the
boundary by the wrong field, and no error estimate sees it.

Sources: Leine, van Campen, de Kraker, van den Steen, Stick-slip vibrations induced by alternate friction models,
Nonlinear Dynamics 16 (1998); Leine, Bifurcations in discontinuous mechanical systems of Filippov-type (2000).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, final

import sympy
from scipy.interpolate import CubicHermiteSpline

from fmu_models.base.arrays import Vector
from fmu_models.validation.methods.equations import HALF, Equations, Mode
from fmu_models.validation.methods.result import (
    CLOSED,
    MINUS,
    OPEN,
    PLUS,
    STICK,
    MethodProblem,
    MethodRun,
    NotTreated,
    needs_fields_alone,
    needs_steady_inputs,
    repeatable,
)
from fmu_models.validation.methods.runge_kutta_fehlberg import steps
from fmu_models.validation.methods.sides import Sides


@final
@dataclass(frozen=True)
class SwitchModel:
    """``eta``: half the width of the band, in the unit of each boundary (m, m/s, N)."""

    eta: float = 1e-4
    frozen: bool = False
    tolerances: tuple[float, ...] = (1e-6, 1e-8, 1e-10, 1e-12)
    family: Literal["switch model"] = "switch model"

    @property
    def name(self) -> str:
        return f"{'frozen' if self.frozen else 'switch model'}, eta {self.eta:g}"

    def prepare(self, problem: MethodProblem) -> Callable[[float], MethodRun]:
        needs_steady_inputs(problem, self.name)
        for contact in problem.system.contacts:
            if contact.kind.rigid:
                raise NotTreated(
                    f"'{contact.name}' is rigid: velocities jump there, and the switch model has fields only. "
                    "Use event-driven Taylor or Moreau time-stepping."
                )
            needs_fields_alone(contact, "no field has")
        equations = Equations(problem.system, pull=_frequency(problem))
        model = _Bands(equations, self.eta)
        sides = Sides(equations)

        def once(tolerance: float) -> tuple[Any, tuple, int]:
            return _run(model, sides, problem, tolerance, self.frozen)

        return repeatable(once, equations.n, first=1e-5)


def _frequency(problem: MethodProblem) -> float:
    """sqrt(k/m), rad/s: of the largest slope of an acceleration over its own coordinate; 1 rad/s without any."""
    equations = Equations(problem.system)
    pairs = zip(problem.system.coordinates, problem.system.acceleration, strict=False)
    signs = equations.signs((STICK,) * len(equations.contacts))
    slopes = [sympy.diff(equations.place(a, signs), q) for q, a in pairs]
    slope_values = equations.function(slopes)(0.0, equations.start(problem.start).tolist())
    return math.sqrt(max((abs(value) for value in slope_values), default=0.0)) or 1.0


def _run(model: _Bands, sides: Sides, problem: MethodProblem, tolerance: float, frozen: bool) -> tuple[Any, tuple, int]:
    z = model.equations.start(problem.start)
    model.evaluations = 0
    sides.begin(0.0, z)
    choose = model.frozen_field if frozen else lambda _t, _z: model.field
    last = z
    for t0, t1, z0, z1, f0, f1 in steps(choose, z, problem.stop_time, tolerance, problem.nominal):
        spline: list[Any] = []

        def between(t: float, a=t0, b=t1, y0=z0, y1=z1, g0=f0, g1=f1, curve=spline) -> Vector:
            if t == b:
                return y1
            if not curve:
                curve.append(CubicHermiteSpline([a, b], [y0, y1], [g0, g1]))
            return curve[0](t)

        sides.step(t0, t1, between, model.mode(t1, z1))
        last = z1
    return last, tuple(sides.switches), model.evaluations


class _Bands:
    """The field of the switch model."""

    def __init__(self, equations: Equations, eta: float) -> None:
        self.equations, self.eta = equations, eta
        self.read = Sides(equations).read
        self.evaluations = 0
        self._stick: dict[Mode, Callable[[float, Any], list[float]]] = {}

    def field(self, t: float, z: Vector) -> list[float]:
        """z' by the mode at this very place."""
        self.evaluations += 1
        values = z.tolist()
        return self.equations.field(self.mode(t, values))(t, values)

    def frozen_field(self, t: float, z: Vector) -> Callable[[float, Vector], list[float]]:
        """The field of the mode at the begin of a step, wherever the step leads."""
        field = self.equations.field(self.mode(t, z.tolist()))

        def kept(t: float, z: Vector) -> list[float]:
            self.evaluations += 1
            return field(t, z.tolist())

        return kept

    def mode(self, t: float, z: Vector | list[float]) -> Mode:
        """States of the contacts, HALF in a band that is crossed."""
        eta = self.eta
        mode = []
        inside = []
        for i, (c, y, d, r) in enumerate(zip(self.equations.contacts, *self.read(t, z), strict=True)):
            if c.kind.compliant:
                mode.append(_side(min(d, r) if c.release is not None else d, eta))
            elif c.depth is not None and d < 0.0:
                mode.append(OPEN)
            elif abs(y) > eta or (c.kind.rubs and not c.sticks):  # a law that never sticks has no jump
                mode.append(PLUS if y > 0.0 else MINUS)
            elif c.sticks:
                inside.append(i)
                mode.append(STICK)
            else:
                mode.append(HALF)
        return self._settled(mode, inside, t, z) if inside else tuple(mode)

    def _settled(self, mode: list[int], inside: list[int], t: float, z: Vector | list[float]) -> Mode:
        """Stick where the forces suffice, else a transition to the side that they cannot prevent."""
        for _ in range(len(inside) + 1):
            key = tuple(mode)
            if key not in self._stick:
                equations, signs = self.equations, self.equations.signs(key)
                capacities = [equations.place(capacity, signs) for c in equations.contacts for capacity in c.capacities]
                self._stick[key] = equations.function([*equations.forces(key), *capacities])
            force = self._stick[key](t, z)
            forces, plus, minus = force[: len(mode)], force[len(mode) :: 2], force[len(mode) + 1 :: 2]
            slipping = [i for i in inside if mode[i] == STICK and not -minus[i] <= forces[i] <= plus[i]]
            if not slipping:
                return key
            mode[slipping[0]] = MINUS if forces[slipping[0]] > 0.0 else PLUS
        return tuple(mode)


def _side(h: float, eta: float) -> int:
    return CLOSED if h > eta else OPEN if h < -eta else HALF
