"""What a declaration promises beside its equations: mirrored motions, and areas that impacts shrink by e squared."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from fmu_models.language.contact_kinds import AWAY
from fmu_models.language.contacts import Contact
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import TIME, Parameter
from fmu_models.simulation.sensitivity import flow_derivative
from fmu_models.simulation.trajectory import Trajectory
from fmu_models.validation.stress.equations import StressEquations, StressFindings
from fmu_models.validation.stress.roles import Model, roles
from fmu_models.validation.stress.trial import Mirror, Trial


@dataclass(frozen=True, eq=False)
class Invariants:
    """What can be asked of a model; None where it promises nothing. ``frequencies`` are names of parameters."""

    mirror: Mirror | None
    divergence: sympy.Expr | None
    frequencies: tuple[str, ...] = ()


def invariants(model: Model) -> Invariants:
    """Find them in the declaration."""
    frequencies = tuple(role.name for role in roles(model) if role.does == "frequency")
    return Invariants(_mirror(model), _divergence(model), frequencies)


def determinant(
    trial: Trial, base: Trajectory, equations: StressEquations, divergence: sympy.Expr
) -> StressFindings | None:
    """det d(q, v)/d(q0, v0) = product of e^2 over the impacts times exp(divergence t), at most four impacts on.

    None if there are no four flights in a row, or a contact does more than bounce.
    """
    impacts = base.events[:5]
    if len(impacts) < 2 or any(event.before != AWAY or event.after != AWAY for event in impacts):
        return None
    case = trial.case
    times = [base.time[0], *(event.time for event in impacts)]
    end = 0.5 * (times[-2] + times[-1])
    if not times[-2] < end < times[-1]:
        return None
    values: dict[Any, Any] = {p: case.parameters.get(p.name, p.value) for p in equations.system.parameters}
    rate: Any = divergence.xreplace(values)
    expected = float(np.exp(float(rate) * (end - times[0])))
    restitution = {c.name: c.restitution for c in equations.system.contacts}
    for event in impacts[:-1]:
        e: Any = restitution[event.contact].xreplace(values)
        expected *= float(e) ** 2
    derivative = flow_derivative(
        trial.fmu, end, start_time=case.begin, parameters=case.parameters, start=case.start, inputs=case.inputs
    ).by_start
    (a, b), (c, d) = derivative
    size = abs(a * d) + abs(b * c)
    wrong = abs(a * d - b * c - expected)
    # rounding of the start is seen through the derivatives themselves
    growth = max(1.0, float(np.abs(derivative).max()))
    return StressFindings(
        float(wrong / size) / growth if size > 0 else 0.0, f"determinant after {len(impacts) - 1} impacts"
    )


def _divergence(model: Model) -> sympy.Expr | None:
    """Of the flow between impacts, if it is a constant and nothing but smooth impacts interrupts it."""
    if not isinstance(model, Mechanism) or len(model.coordinates) != 1 or not model.contacts:
        return None
    if not all(contact.kind.impulsive and contact.directions == 1 for contact in model.contacts):
        return None
    (q,) = model.coordinates
    mass = sympy.diff(model.kinetic_energy, q.v, 2)
    force = -sympy.diff(model.dissipation, q.v) + model.applied.get(q, sympy.S.Zero)
    divergence = sympy.simplify(sympy.diff(force, q.v) / mass)
    constant = all(isinstance(symbol, Parameter) for symbol in divergence.free_symbols | mass.free_symbols)
    return divergence if constant else None


def _mirror(model: Model) -> Mirror | None:
    """The change of signs and phases under which the declaration is odd."""
    if not isinstance(model, Mechanism):
        return None
    signed = {role.name for role in roles(model) if role.does in ("amplitude", "field", "drive")}
    parameters = [p for p in model.parameters if p.name in signed and p.minimum is None and p.maximum is None]
    phases = _phases(model)
    for flipped, turned in ((parameters, []), ([], phases), ([], [])):
        change: dict[Any, Any] = {p: -p for p in flipped} | {p: p + sympy.pi for p in turned}
        change |= {s: -s for q in model.coordinates for s in (q, q.v)}
        change |= {s: -s for u in model.inputs for s in (u, u.rate)}
        if _is_odd(model, change):
            names = [*(p.name for p in flipped), *(u.name for u in model.inputs)]
            return Mirror(frozenset(names), frozenset(p.name for p in turned))
    return None


def _phases(model: Mechanism) -> list[Parameter]:
    """Parameters that a function of time adds to a multiple of the time."""
    expressions = [*model.applied.values(), *(sympy.sympify(c.place) for c in model.impacts)]
    waves = [wave for e in expressions for wave in e.atoms(sympy.Function) if wave.has(TIME)]
    return [p for p in model.parameters if any(sympy.diff(wave.args[0], p) == 1 for wave in waves)]


def _is_odd(model: Mechanism, change: dict[Any, Any]) -> bool:
    def same(a: sympy.Expr, b: sympy.Expr) -> bool:
        return sympy.expand(sympy.sympify(a).xreplace(change) - sympy.sympify(b)) == 0

    energies = (model.kinetic_energy, model.potential_energy, model.dissipation)
    if not all(same(e, e) for e in energies) or not all(same(f, -f) for f in model.applied.values()):
        return False
    for contact in model.frictions:
        turned = contact.law.force(-contact.slip_speed, -contact.sign)
        odd = sympy.simplify(turned + contact.law.force(contact.slip_speed, contact.sign)) == 0
        if contact.where is not None or contact.law.states or not odd or not same(contact.slip, -contact.slip):
            return False
    return all(_has_twin(model, contact, same) for contact in model.contacts if contact not in model.frictions)


def _has_twin(model: Mechanism, contact: Contact, same: Callable[[Any, Any], bool]) -> bool:
    """Whether the mirror makes another contact of the model from a stop or rigid contact."""
    for twin in model.contacts:
        if twin.kind is contact.kind and same(contact.place, twin.place):
            return contact.rule == twin.rule and getattr(contact, "slip", None) is None
    return False
