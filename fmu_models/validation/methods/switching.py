"""What happens at the events of a system, in Python: for methods that find events but do not know contacts.

Independent of the engine, and a good deal simpler. In a mode (equations.py) it watches functions that fall to zero:

    friction, sliding switch   slip: s y        stick: lambda's distance to its bounds            region: its depth
    other switch               s h              (then the sign changes, or the states jump)
    stop                       open: -depth     touching: depth, or its force     released: depth, -force
    rigid contact              open: gap        closed: lambda

One falls at t, and then

    a slip that ends      of the states (stick, +, -) of all contacts without slip, the first that is consistent: forces
                          of stick within capacity, slip speeds growing along their sign; y := 0
    a stick that breaks   slips against the force that could not hold it
    a touch               the stop pushes; it remembers y
    a collision           v+ = v- - (1 + e) W y-/G, then it is open; closed if it leaves with less than REST of its
                          fastest approach so far and is pressed on

until the end. What it leaves to the engine: impacts of several contacts at once, or with friction, infinitely many
bounces, stick shared by contacts.
"""

import itertools
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, Protocol

import sympy

from fmu_models.validation.methods.equations import Equations, Mode, Number, State, first_mode
from fmu_models.validation.methods.result import CLOSED, MINUS, OPEN, PLUS, RELEASED, STICK, NotTreated, SwitchEvent

REST = 1e-12
MOST = 100_000  # events of a run
SHORTEST = 1e-12  # of the run: events closer than this for CROWD of them in a row are infinitely many
CROWD = 50
LOOK_AHEAD = 1e-8  # of the run: two events are simultaneous if they lie a thousandth of this apart
BETTER = "Use event-driven Taylor or Moreau time-stepping."


@dataclass(frozen=True)
class Watch:
    """A function that falls to zero: of contact ``i``; what it is; its expression."""

    i: int
    what: str
    expression: sympy.Expr


class SwitchStepper(Protocol):
    """Integrates in one mode up to ``stop`` or the first watched function that falls to zero, and says which."""

    @property
    def evaluations(self) -> int:
        """Right-hand sides so far."""
        ...

    def advance(self, mode: Mode, t: Number, z: State, stop: Number) -> tuple[Number, State, int | None]:
        """Time and state there, and the index of the watch that fell; None at ``stop``."""
        ...


def watches(equations: Equations, mode: Mode) -> list[Watch]:
    """What to watch in a mode."""
    watches_of_mode: list[Watch] = []
    forces, signs = equations.forces(mode), equations.signs(mode)
    for i, (contact, state) in enumerate(zip(equations.contacts, mode, strict=True)):
        depth: Any = contact.depth
        if contact.kind.compliant:
            release: Any = None if contact.release is None else equations.place(contact.release, signs)
            if state == OPEN:
                watches_of_mode.append(Watch(i, "touch", -depth))
            elif state == CLOSED:
                watches_of_mode.append(Watch(i, "release", depth if release is None else release))
            else:
                watches_of_mode += [Watch(i, "leave", depth), Watch(i, "touch", -release)]
        elif contact.kind.impulsive:
            watches_of_mode.append(Watch(i, "collide", -depth) if state == OPEN else Watch(i, "lift", forces[i]))
        elif not contact.kind.led:
            if state == OPEN:
                watches_of_mode.append(Watch(i, "enter", -depth))
                continue
            if depth is not None:
                watches_of_mode.append(Watch(i, "exit", depth))
            if state == STICK:
                plus, minus = (equations.place(capacity, signs) for capacity in contact.capacities)
                watches_of_mode += [Watch(i, "break-", plus - forces[i]), Watch(i, "break+", minus + forces[i])]
            else:
                watches_of_mode.append(Watch(i, "slip", state * contact.slip))
    return watches_of_mode


class Run:
    """One run through all events. ``modules`` is that of the functions: "math", or "mpmath" for more digits."""

    def __init__(self, equations: Equations, modules: str = "math") -> None:
        self.equations = equations
        self.contacts = equations.contacts
        self.switches: list[SwitchEvent] = []
        self._modules = modules
        self._kept: dict[Hashable, Callable[[Any, Any], list[Any]]] = {}
        self._watches: dict[Mode, list[Watch]] = {}
        for contact in self.contacts:
            if contact.kind.led:
                raise NotTreated(f"'{contact.name}': impacts with friction are beyond this event loop. {BETTER}")
            if contact.poisson:
                raise NotTreated(f"'{contact.name}': Poisson's restitution is beyond this event loop. {BETTER}")

    def watches(self, mode: Mode) -> list[Watch]:
        """What to watch in a mode."""
        if mode not in self._watches:
            self._watches[mode] = watches(self.equations, mode)
        return self._watches[mode]

    def values(self, key: Hashable, expressions: Callable[[], list[Any]], t: Number, z: State) -> list[Any]:
        """Values of expressions, compiled under a key."""
        if key not in self._kept:
            self._kept[key] = self.equations.function(expressions(), self._modules)
        return self._kept[key](t, z)

    def to(self, stepper: SwitchStepper, z: State, stop: Number) -> State:
        """The state at ``stop``; ``switches`` holds what happened. NotTreated: an event that this loop leaves to the
        engine."""
        self.switches = []
        t: Any = stop * 0
        self._fastest = [0.0] * len(self.contacts)
        mode, z = self._begin(t, z)
        crowd = 0
        for _ in range(MOST):
            before = t
            t, z, fell = stepper.advance(mode, t, z, stop)
            if fell is None:
                return z
            crowd = crowd + 1 if t - before < SHORTEST * stop else 0
            if crowd > CROWD:
                raise NotTreated(f"at {float(t):g} s events follow each other without end (chatter). {BETTER}")
            mode, z = self._after_all(mode, self.watches(mode)[fell], t, z, stop)
        raise NotTreated(f"more than {MOST} events by {float(t):g} s. {BETTER}")

    def _begin(self, t: Number, z: State) -> tuple[Mode, State]:
        """Contact states at the start: by their sides, and where those tie by consistency."""
        mode = first_mode(self.equations, z)
        depths = self.values("depths", lambda: [c.depth if c.depth is not None else 1 for c in self.contacts], t, z)
        mode = tuple(OPEN if c.kind.dry and d < 0 else s for c, s, d in zip(self.contacts, mode, depths, strict=True))
        slips = self._slips(t, z)
        for i, contact in enumerate(self.contacts):
            if contact.kind.impulsive and mode[i] == OPEN and abs(depths[i]) <= 1e-15 and abs(slips[i]) <= 1e-15:
                closed = (*mode[:i], CLOSED, *mode[i + 1 :])
                if self._forces(closed, t, z)[i] > 0:
                    mode = closed
            if contact.kind.compliant and mode[i] == CLOSED:
                touching = self.watches(mode)
                values = self._watched(mode, t, z)
                if any(w.i == i and w.what == "release" and v < 0 for w, v in zip(touching, values, strict=True)):
                    mode = (*mode[:i], RELEASED, *mode[i + 1 :])
        if any(c.sticks and mode[i] != OPEN and slips[i] == 0 for i, c in enumerate(self.contacts)):
            return self._settle(mode, t, z, {})
        return mode, z

    def _slips(self, t: Number, z: State) -> list[Any]:
        return self.values("slips", lambda: [c.slip for c in self.contacts], t, z)

    def _forces(self, mode: Mode, t: Number, z: State) -> list[Any]:
        return self.values(("forces", mode), lambda: list(self.equations.forces(mode)), t, z)

    def _watched(self, mode: Mode, t: Number, z: State) -> list[Any]:
        return self.values(("watches", mode), lambda: [w.expression for w in self.watches(mode)], t, z)

    def _after_all(self, mode: Mode, fell: Watch, t: Number, z: State, stop: Number) -> tuple[Mode, State]:
        """Mode and state after an event and all others at the same time, one after the other."""
        done: set[int] = set()
        due: Watch | None = fell
        while due is not None:
            done.add(due.i)
            before = mode
            mode, z = self._after(mode, due, t, z)
            done |= {j for j, (old, new) in enumerate(zip(before, mode, strict=True)) if old != new}
            due = self._due(mode, done, t, z, stop)
        return mode, z

    def _due(self, mode: Mode, done: set[int], t: Number, z: State, stop: Number) -> Watch | None:
        """A watched function of another contact that is zero now and about to be negative."""
        watched = self._watched(mode, t, z)
        step = LOOK_AHEAD * stop
        rates = self.values(("rates", mode), lambda: list(self.equations.rates(mode)), t, z)
        soon = self._watched(mode, t + step, [a + step * rate for a, rate in zip(z, rates, strict=True)])
        for watch, first, then in zip(self.watches(mode), watched, soon, strict=True):
            if watch.i not in done and then < 0 and first <= 1e-3 * abs(then - first):
                return watch
        return None

    def _after(self, mode: Mode, fell: Watch, t: Number, z: State) -> tuple[Mode, State]:
        """Mode and state after one event."""
        i, contact = fell.i, self.contacts[fell.i]
        after = list(mode)
        if fell.what in ("break-", "break+"):
            next_mode, z = self._settle(mode, t, z, {i: MINUS if fell.what == "break-" else PLUS})
        elif fell.what == "slip" and contact.reset and contact.reset_sides & (1 if mode[i] == PLUS else 2):
            next_mode, z = tuple(mode), self._jump(i, t, z)
        elif fell.what == "slip" and not contact.sticks:
            after[i] = -mode[i]
            next_mode = tuple(after)
        elif fell.what == "slip":
            next_mode, z = self._settle(mode, t, z, {})
        elif fell.what == "collide":
            next_mode, z = self._collide(mode, i, t, z)
        else:
            if fell.what == "touch" and contact.remembers:
                moved = list(z)
                moved[self.equations.n + self.equations.memories.index(i)] = self._slips(t, z)[i]
                z = _like(z, moved)
            after[i] = {
                "touch": CLOSED,
                "release": OPEN if contact.release is None else RELEASED,
                "leave": OPEN,
                "lift": OPEN,
                "exit": OPEN,
                "enter": PLUS if self._slips(t, z)[i] >= 0 else MINUS,
            }[fell.what]
            next_mode = tuple(after)
            if STICK in next_mode:  # the forces that held the others may not suffice any more
                next_mode, z = self._settle(next_mode, t, z, {})
        for j, contact in enumerate(self.contacts):
            if contact.reset_sides & 4 and (mode[j] == STICK) != (next_mode[j] == STICK):
                z = self._jump(j, t, z)
        bounced = i if fell.what == "collide" and next_mode[i] == OPEN else None
        for j, (old, new) in enumerate(zip(mode, next_mode, strict=True)):
            if old != new or j == bounced:
                self.switches.append(SwitchEvent(float(t), self.contacts[j].name, old, new))
        return next_mode, z

    def _settle(self, mode: Mode, t: Number, z: State, forced: dict[int, int]) -> tuple[Mode, State]:
        """States of all contacts without slip that are consistent with each other; slips set to zero."""
        slips = self._slips(t, z)
        scale = max(1.0, *(abs(float(s)) for s in slips))
        zero = [
            j
            for j, c in enumerate(self.contacts)
            if c.sticks and mode[j] != OPEN and (abs(slips[j]) < 1e-10 * scale or mode[j] == STICK)
        ]
        for j in zero:
            z = self._project(j, t, z)
        choices = [[forced[j]] if j in forced else [STICK, PLUS, MINUS] for j in zero]
        for states in itertools.product(*choices):
            trial = list(mode)
            for j, state in zip(zero, states, strict=True):
                trial[j] = state
            try:
                if self._consistent(tuple(trial), zero, forced, t, z):
                    return tuple(trial), z
            except NotTreated:
                if len(zero) < 2:
                    raise
        raise NotTreated(f"at {float(t):g} s no states of the contacts without slip fit together. {BETTER}")

    def _consistent(self, mode: Mode, zero: list[int], forced: dict[int, int], t: Number, z: State) -> bool:
        forces = self._forces(mode, t, z)

        def expressions() -> list[Any]:
            equations, signs = self.equations, self.equations.signs(mode)
            lambdas, capacities_of = equations.forces(mode), []
            for j, c in enumerate(equations.contacts):
                pull = sum(equations.system.G[j, k] * lambdas[k] for k in range(len(lambdas)))
                capacities = [equations.place(capacity, signs) for capacity in c.capacities]
                capacities_of += [*capacities, equations.place(c.slip_rate, signs) + pull]
            return capacities_of

        residuals = self.values(("consistent", mode), expressions, t, z)
        for j in zero:
            plus, minus, rate = residuals[3 * j : 3 * j + 3]
            if mode[j] == STICK and not -minus <= forces[j] <= plus:
                return False
            if mode[j] != STICK and j not in forced and mode[j] * rate < 0:
                return False
        return True

    def _project(self, j: int, t: Number, z: State) -> State:
        """The state with the slip of one contact set to zero."""
        system = self.equations.system

        def expressions() -> list[Any]:
            return [system.contacts[j].slip, system.G[j, j], *(system.W[i, j] for i in range(system.W.rows))]

        y, G, *W = self.values(("project", j), expressions, t, z)
        return self._pushed(z, W, y / G)

    def _pushed(self, z: State, W: list[Any], impulse: Any) -> State:
        """The state after an impulse against a contact, which changes the velocities by the rows of W."""
        n, moved = len(self.equations.system.coordinates), list(z)
        for i, w in enumerate(W):
            moved[n + i] -= w * impulse
        return _like(z, moved)

    def _collide(self, mode: Mode, i: int, t: Number, z: State) -> tuple[Mode, State]:
        contact, system = self.contacts[i], self.equations.system
        for j, c in enumerate(self.contacts):
            if j != i and c.kind.impulsive and mode[j] == CLOSED and system.G[i, j] != 0:
                raise NotTreated(f"at {float(t):g} s '{contact.name}' collides while '{c.name}' is closed. {BETTER}")

        def expressions() -> list[Any]:
            W = (system.W[k, i] for k in range(system.W.rows))
            return [contact.slip, system.G[i, i], contact.restitution, *W]

        y, G, e, *W = self.values(("collide", i), expressions, t, z)
        self._fastest[i] = max(self._fastest[i], abs(float(y)))
        rests = abs(e * y) <= REST * self._fastest[i]
        z = self._pushed(z, W, (1 if rests else 1 + e) * y / G)
        if rests:
            closed = (*mode[:i], CLOSED, *mode[i + 1 :])
            if self._forces(closed, t, z)[i] > 0:
                return closed, z
        return mode, z

    def _jump(self, i: int, t: Number, z: State) -> State:
        reset = self.contacts[i].reset
        states = self.equations.system.states
        new = self.values(("reset", i), lambda: [reset.get(s, s) for s in states], t, z)
        return _like(z, [*new, *list(z)[len(states) :]])


def _like(z: State, values: list[Any]) -> State:
    """The values in the kind of array that z is."""
    import numpy as np

    return np.array(values, dtype=z.dtype) if isinstance(z, np.ndarray) else values
