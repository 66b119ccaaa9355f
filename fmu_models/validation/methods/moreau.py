"""Moreau's time-stepping: impulses over steps of fixed length, no events.

    q_m = q + h/2 v                                                   where the contacts are looked for
    v+  = v + h a(t_m, q + theta h v_theta, v_theta) + W P            v_theta = (1 - theta) v + theta v+
    rigid contact, gap(q_m) <= 0:   0 <= P  orthogonal to  y+ + e y- >= 0
    its friction:                   |P_T| <= mu P_N,     y_T+ = 0 where it is less
    friction, sliding switch:       |P| <= h capacity,   y+ = 0 where it is less (a capacity for each sign of P)
    q+  = q_m + h/2 v+

a, with the forces of compliant stops on the side of q_m, is linearised at the begin of the step (one step of Newton's
method); the impulses are found by projected Gauss-Seidel iteration. Errors are of order h where contacts change and of
order h^2 between for theta = 1/2.

Sources: Moreau, Unilateral contact and dry friction in finite freedom dynamics (1988); Acary and Brogliato, Numerical
methods for nonsmooth dynamical systems (2008), chapter 10.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, final

import numpy as np
import sympy

from fmu_models.base.arrays import Vector
from fmu_models.language.contact_dynamics import ContactDynamics
from fmu_models.validation.methods.equations import Equations, Mode
from fmu_models.validation.methods.result import (
    CLOSED,
    MINUS,
    OPEN,
    PLUS,
    STICK,
    MethodProblem,
    MethodRun,
    NotTreated,
    SwitchEvent,
    needs_fields_alone,
    needs_steady_inputs,
    repeatable,
)

SWEEPS = 200  # of the projection; each costs a few products
SETTLED = 1e-14  # of the impulses: change of a sweep at which it ends


@final
@dataclass(frozen=True)
class Moreau:
    """``theta`` weights the end of a step. Tolerances are steps in parts of the run."""

    theta: float = 0.5
    tolerances: tuple[float, ...] = (1e-3, 1e-4, 3e-5)
    family: Literal["time-stepping"] = "time-stepping"

    @property
    def name(self) -> str:
        return f"Moreau time-stepping, theta {self.theta:g}"

    def prepare(self, problem: MethodProblem) -> Callable[[float], MethodRun]:
        needs_steady_inputs(problem, self.name)
        for contact in problem.system.contacts:
            if contact.poisson:
                raise NotTreated(
                    f"'{contact.name}': Poisson's restitution is not that of Moreau's scheme. Use event-driven Taylor."
                )
            needs_fields_alone(contact, "its steps do not see")
        stepping = _Stepping(Equations(problem.system), self.theta)
        return repeatable(lambda tolerance: stepping.run(problem, tolerance), stepping.equations.n, first=1e-2)


class _Stepping:
    """The scheme for one system."""

    def __init__(self, equations: Equations, theta: float) -> None:
        self.equations, self.theta = equations, theta
        system = equations.system
        self.n_q, self.n_v = len(system.coordinates), len(system.driven)
        n = len(equations.contacts)
        signs = equations.signs((STICK,) * n)
        gaps = [sympy.S.One if c.depth is None else c.depth for c in equations.contacts]
        releases = [sympy.S.One if c.release is None else equations.place(c.release, signs) for c in equations.contacts]
        self._place = equations.function([*gaps, *releases])
        self._contact = equations.function(
            [*(c.slip for c in equations.contacts), *system.W, *system.G, *(c.restitution for c in equations.contacts)]
        )
        self._mu = equations.function([c.friction for c in equations.contacts])
        slopes = [sympy.diff(sympy.sympify(c.slip), v) for c in equations.contacts for v in system.driven]
        self._slopes = equations.function(slopes)
        self._fields: dict[Mode, Callable[[float, Any], list[float]]] = {}
        self._limits: dict[Mode, Callable[[float, Any], list[float]]] = {}

    def run(self, problem: MethodProblem, fraction: float) -> tuple[Vector, tuple[SwitchEvent, ...], int]:
        """All steps, each ``part`` of the run."""
        count = max(1, round(1.0 / fraction))
        h = problem.stop_time / count
        z = self.equations.start(problem.start)
        n = len(self.equations.contacts)
        history = _History(self.equations)
        impulses = np.zeros(n)
        for step in range(count):
            t = step * h
            mode, active = self._sides(t, z, h)
            z, impulses, slipping = self._step(t, z, h, mode, active, impulses)
            history.add(t + h, mode, active, impulses, slipping)
        return z, tuple(history.switches), count

    def _sides(self, t: float, z: Vector, h: float) -> tuple[Mode, list[int]]:
        """States of stops and regions at the middle of the step, and the contacts that may carry an impulse."""
        middle = z.copy()
        middle[: self.n_q] += h / 2 * z[self.n_q : 2 * self.n_q]
        n = len(self.equations.contacts)
        values = self._place(t + h / 2, middle.tolist())
        slips = self._contact(t, z.tolist())[:n]
        mode, active = [], []
        for i, (c, d, r, y) in enumerate(zip(self.equations.contacts, values[:n], values[n:], slips, strict=True)):
            if c.kind.compliant:
                mode.append(CLOSED if d > 0.0 and r >= 0.0 else OPEN)
            elif c.kind.impulsive:
                mode.append(OPEN)
                active += [i] if d >= 0.0 else []
            elif c.kind.led:
                mode.append(OPEN)
                active += [i] if c.partner in active else []
            elif c.depth is not None and d < 0.0:
                mode.append(OPEN)
            else:
                mode.append(PLUS if y >= 0.0 else MINUS)
                active += [i] if c.sticks else []
        return tuple(mode), active

    def _functions(self, mode: Mode) -> tuple[Callable[[float, Any], list[float]], Callable[[float, Any], list[float]]]:
        """Rates and their Jacobian without the forces of friction; the friction that each contact could carry."""
        if mode not in self._fields:
            equations = self.equations
            smooth = tuple(
                OPEN if c.sticks and s in (PLUS, MINUS) else s for c, s in zip(equations.contacts, mode, strict=True)
            )
            # without friction, but with the signs that internal states and other switches know
            signs = equations.signs(mode)
            rates = equations.rates_under(equations.forces(smooth), signs)
            free = [rate.xreplace(signs) if hasattr(rate, "xreplace") else rate for rate in rates]
            jacobian = sympy.Matrix(free).jacobian(sympy.Matrix(equations.symbols))
            self._fields[mode] = equations.function([*free, *jacobian])
            limits = [
                abs(equations.place(bound, signs))
                for c, state in zip(equations.contacts, mode, strict=True)
                for bound in _bounds(c, state)
            ]
            self._limits[mode] = equations.function(limits)
        return self._fields[mode], self._limits[mode]

    def _step(
        self, t: float, z: Vector, h: float, mode: Mode, active: list[int], last: Vector
    ) -> tuple[Vector, Vector, list[int]]:
        """One step: state, impulses (n_contacts,), and the contacts whose friction is at its limit."""
        theta, n_q, n_v, size = self.theta, self.n_q, self.n_v, z.size
        field, limits = self._functions(mode)
        velocity = np.array(field(t + theta * h, z.tolist()))
        rates, jacobian = velocity[:size], velocity[size:].reshape(size, size)
        # (1 - theta h J) dz = h f: the theta method, linearised; its rows of velocities take the impulses too
        matrix = np.eye(size) - theta * h * jacobian
        free = np.linalg.solve(matrix, h * rates)
        new = z + free
        impulses = np.zeros(len(self.equations.contacts))
        slipping: list[int] = []
        if active:
            n = impulses.size
            values = np.array(self._contact(t + h, z.tolist()))
            W = values[n : n + n_v * n].reshape(n_v, n)[:, active]
            spread = np.zeros((size, len(active)))
            spread[n_q : n_q + n_v] = W
            spread = np.linalg.solve(matrix, spread)
            before = np.array(self._contact(t, z.tolist()))[:n]
            after = np.array(self._contact(t + h, new.tolist()))[:n]
            gradient = self._gradient(t + h, z, active, size)
            e = values[n + n_v * n + n * n :]
            impulses, slipping = self._project(active, gradient @ spread, before, after, e, limits, t, z, h, last)
            new = new + spread @ impulses[active]
        velocities = z[n_q : 2 * n_q], new[n_q : 2 * n_q]
        new[:n_q] = z[:n_q] + h / 2 * (velocities[0] + velocities[1])
        return new, impulses, slipping

    def _gradient(self, t: float, z: Vector, active: list[int], size: int) -> Vector:
        """dy/dz of the velocities for the active contacts; slips are affine in them."""
        slopes = np.array(self._slopes(t, z.tolist())).reshape(-1, self.n_v)
        gradient = np.zeros((len(active), size))
        gradient[:, self.n_q : self.n_q + self.n_v] = slopes[active]
        return gradient

    def _project(
        self, active: list[int], G: Vector, before: Vector, after: Vector, e: Vector,
        limits: Callable[[float, Any], list[float]], t: float, z: Vector, h: float, last: Vector,
    ) -> tuple[Vector, list[int]]:  # fmt: skip
        """Impulses by projected Gauss-Seidel iteration, and the friction contacts at their limit."""
        contacts = self.equations.contacts
        position = {i: k for k, i in enumerate(active)}
        bounds = np.array(limits(t, z.tolist()), dtype=float).reshape(-1, 2) * h
        mu = self._mu(t, z.tolist())
        P = np.array([last[i] for i in active])
        target = np.array([after[i] + (e[i] * before[i] if contacts[i].kind.impulsive else 0.0) for i in active])
        capacity = np.zeros((len(active), 2))  # of P and of -P
        for _ in range(SWEEPS):
            change = 0.0
            for k, i in enumerate(active):
                unbounded = P[k] - (target[k] + G[k] @ P) / G[k, k]
                if contacts[i].kind.impulsive:
                    unbounded = max(0.0, unbounded)
                else:
                    partner = contacts[i].partner
                    capacity[k] = bounds[i] if partner is None else mu[i] * P[position[partner]]
                    unbounded = min(capacity[k, 0], max(-capacity[k, 1], unbounded))
                change = max(change, abs(unbounded - P[k]))
                P[k] = unbounded
            if change <= SETTLED * max(1e-300, float(np.abs(P).max())):
                break
        impulses = np.zeros(len(contacts))
        impulses[active] = P
        limit = np.where(P > 0.0, capacity[:, 0], capacity[:, 1])
        at_limit = [i for k, i in enumerate(active) if not contacts[i].kind.impulsive and abs(P[k]) >= limit[k] > 0.0]
        return impulses, at_limit


def _bounds(contact: ContactDynamics, state: int) -> tuple[Any, Any]:
    """What friction may be along positive and along negative impulses: the law's force, where slip has its other sign
    and friction depends on that what stick can hold."""
    plus, minus = contact.capacities if contact.capacity_minus is not None else (contact.force, contact.force)
    return (contact.force, minus) if state == MINUS else (plus, contact.force)


class _History:
    """Changes of contact states as the impulses show them, to one step."""

    def __init__(self, equations: Equations) -> None:
        self.contacts = equations.contacts
        self.states: list[int] | None = None
        self.begun = [0.0] * len(self.contacts)
        self.count = [0] * len(self.contacts)
        self.switches: list[SwitchEvent] = []

    def add(self, t: float, mode: Mode, active: list[int], impulses: Vector, slipping: list[int]) -> None:
        """Take in the step that ends at t."""
        states = []
        for i, contact in enumerate(self.contacts):
            if contact.kind.impulsive:
                self._normal(i, t, impulses[i] > 0.0)
                states.append(OPEN)
            elif i not in active:
                states.append(mode[i])
            elif i in slipping:
                states.append(MINUS if impulses[i] > 0.0 else PLUS)
            else:
                states.append(STICK if contact.partner is None or impulses[i] != 0.0 else OPEN)
        for i, (old, new) in enumerate(zip(self.states or states, states, strict=True)):
            if old != new:
                self.switches.append(SwitchEvent(t, self.contacts[i].name, old, new))
        self.states = states

    def _normal(self, i: int, t: float, pushed: bool) -> None:
        """A push of one step is a bounce, one of several a closed contact."""
        name = self.contacts[i].name
        if pushed:
            self.count[i] += 1
            if self.count[i] == 1:
                self.begun[i] = t
            elif self.count[i] == 2:
                self.switches.append(SwitchEvent(self.begun[i], name, OPEN, CLOSED))
        elif self.count[i]:
            first = self.count[i] == 1
            self.switches.append(SwitchEvent(self.begun[i] if first else t, name, OPEN if first else CLOSED, OPEN))
            self.count[i] = 0
