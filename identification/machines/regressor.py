"""The regressor of a declared machine: the efforts that its motion takes, linear in what is to be found.

    tau = d/dt dL/dv - dL/dq + dD/dv - sum_c (d slip_c/dv)^T lambda_c - Q0 = Y(q, v, a) theta,    L = T - U

theta are the parameters of the declaration or products of them (monomials). Nothing is derived symbolically: an energy
E is evaluated once with hyper-dual numbers, e1 along one velocity or coordinate and e2 along the motion (q by v, v by
a), which gives d/dt dE/dv and dE/dq to rounding for any number of joints.

Base parameters are what efforts can tell of the machine, whatever its motion. Columns that depend on earlier ones, in
the order of the declaration, are taken up by these: theta_k moves the base parameters theta_i by c_ik theta_k. What no
motion needs drops out.

Sources: Khalil, Dombre, Modeling, Identification and Control of Robots (2002), chapter 9 (the form); Gautier (1991), J.
Robotic Systems 8, 485 (base parameters by QR; here by Gram-Schmidt in a given order, which is QR without pivots).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from fmu_models.base.errors import StickslipError, named
from fmu_models.base.shown import Shown
from fmu_models.language.contacts import Contact
from fmu_models.language.friction import Friction
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Input, Parameter
from identification.machines.hyper_dual import FUNCTIONS, HyperDual
from identification.machines.linear_parts import NOTHING, Monomial, Parts, linear_parts, monomial_name, monomial_unit

CHUNK = 1024  # rows at once: what is in between of a long chain then stays in the processor's cache
SIGN = sympy.Dummy("sign", real=True)
SLIP = sympy.Dummy("slip", real=True)
GIVEN = monomial_name(NOTHING)
SAMPLES = 60  # of random motion, for each monomial
DEPENDENT = 1e-9  # relative to the column: what is left of one that others make up
SEED = 20


@dataclass(frozen=True, eq=False)
class Regressor:
    """Y of a machine. joints: names of the coordinates, in order; efforts: input that drives each; names, units: of
    the monomials theta (m,), ``GIVEN`` for what holds nothing that is to be found; frictional: (m,) whether a monomial
    stands in friction alone (contacts, dissipation); declared: (m,) its value by the declaration."""

    joints: tuple[str, ...]
    efforts: tuple[str, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    frictional: np.ndarray
    declared: np.ndarray
    _terms: _Terms

    def __call__(self, q: np.ndarray, v: np.ndarray, a: np.ndarray, *, smooth: np.ndarray | None = None) -> np.ndarray:
        """Y (n, joints, m) at positions, velocities and accelerations (n, joints) each; smooth: (joints,) velocities
        over which Coulomb friction turns, 0 if None."""
        count = len(self.joints)
        matrix = np.zeros((len(q), count, len(self.names)))
        over = np.zeros(count) if smooth is None else smooth
        for start in range(0, len(q), CHUNK):
            at = slice(start, start + CHUNK)
            self._terms.add_energies(matrix[at], q[at], v[at], a[at])
            self._terms.add_friction(matrix[at], q[at], v[at], over)
        return matrix


def regressor_of(mechanism: Mechanism, known: Mapping[str, float] | None = None) -> Regressor:
    """The regressor of a mechanism. known: values of parameters that are not to be found, by name. StickslipError: a
    parameter is not there, nothing is to be found, an input does not drive one joint alone, a contact opens, or the
    efforts are not linear in products of parameters."""
    missing = f"{mechanism.name} has no parameter"
    known_values = (known or {}).items()
    values = {named(mechanism.parameters, name, f"{missing} '{name}'."): float(value) for name, value in known_values}
    drives, others = _drives(mechanism)
    unknown = {p for p in mechanism.parameters if p not in values}
    if not unknown:
        raise StickslipError(f"All parameters of {mechanism.name} are known: there is nothing to find.")
    at = {parameter: sympy.Float(value) for parameter, value in values.items()}

    def parts(expression: sympy.Expr) -> Parts:
        return linear_parts(substituted(expression, at), unknown)

    lagrangian = parts(mechanism.kinetic_energy)
    for monomial, motion in parts(mechanism.potential_energy).items():
        lagrangian[monomial] = lagrangian.get(monomial, sympy.S.Zero) - motion
    dissipation = parts(mechanism.dissipation)
    forces = [_forces(mechanism, contact, parts) for contact in mechanism.contacts]
    applied = [{m: -e for m, e in parts(expression).items()} for expression in others]
    for terms in (lagrangian, dissipation, *(force for force, _, _ in forces), *applied):
        if terms.get(NOTHING) == 0:
            del terms[NOTHING]
    every = (lagrangian, dissipation, *(force for force, _, _ in forces), *applied)
    monomials = sorted({m for terms in every for m in terms}, key=lambda m: [(p.declared, n) for p, n in m])
    frictional = {m for terms in (dissipation, *(force for force, _, _ in forces)) for m in terms}
    frictional -= {NOTHING, *(m for terms in (lagrangian, *applied) for m in terms)}
    return Regressor(
        tuple(q.name for q in mechanism.coordinates),
        tuple(drive.name for drive in drives),
        tuple(monomial_name(m) for m in monomials),
        tuple(monomial_unit(m) for m in monomials),
        np.array([m in frictional for m in monomials]),
        np.array([float(np.prod([p.value**power for p, power in m])) for m in monomials]),
        _Terms(mechanism, monomials, lagrangian, dissipation, forces, applied),
    )


def substituted(expression: sympy.Expr, at: Mapping[Parameter, sympy.Expr]) -> sympy.Expr:
    """The expression with parameters at values; every shared part is rebuilt once."""
    rebuilds: dict[Any, Any] = dict(at)

    def rebuilt(e: sympy.Basic) -> Any:
        if e not in rebuilds:
            inner = [rebuilt(argument) for argument in e.args]
            rebuilds[e] = e if inner == list(e.args) else e.func(*inner)
        return rebuilds[e]

    return rebuilt(sympy.sympify(expression))


def effort_inputs(mechanism: Mechanism) -> list[Input]:
    """The input that is the effort on each coordinate. StickslipError: a coordinate has none, or shares it."""
    return _drives(mechanism)[0]


def _drives(mechanism: Mechanism) -> tuple[list[Input], list[sympy.Expr]]:
    """The input that is the effort on each coordinate, and what else is applied there."""
    drives, others = [], []
    for q in mechanism.coordinates:
        force = sympy.sympify(mechanism.applied.get(q, sympy.S.Zero))
        inputs = [s for s in force.free_symbols if isinstance(s, Input)]
        if len(inputs) != 1 or sympy.diff(force, inputs[0]) != 1:
            raise StickslipError(
                f"The force on '{q.name}' of {mechanism.name} is '{sympy.sstr(force)}': a machine is identified from "
                "the measured effort of each joint, so it must hold one input of its own as a summand, "
                f"applied={{{q.name}: tau_{q.name}}}."
            )
        drives.append(inputs[0])
        others.append(force - inputs[0])
    if len(set(drives)) < len(drives):
        raise StickslipError(f"One input of {mechanism.name} drives two joints: give each joint an effort of its own.")
    return drives, others


def _forces(
    mechanism: Mechanism, contact: Contact, parts: Callable[[sympy.Expr], Parts]
) -> tuple[Parts, sympy.Expr, list[sympy.Expr]]:
    """Force of a contact along its slip, slip speed, and its derivative by each velocity."""
    if not isinstance(contact, Friction):
        raise StickslipError(
            f"Contact '{contact.name}' of {mechanism.name} opens and closes: its force is not linear in parameters "
            "that a log of efforts gives. Identify the machine away from it, and declare it without."
        )
    if contact.where is not None:
        raise StickslipError(f"Contact '{contact.name}' of {mechanism.name} is not closed everywhere; declare it so.")
    if contact.law.states:
        raise StickslipError(
            f"The law {type(contact.law).__name__} of contact '{contact.name}' has states that no log shows. Take one "
            "without, such as Coulomb, with a dissipation for viscous friction."
        )
    slip = sympy.sympify(contact.slip)
    try:
        force = parts(contact.law.force(SLIP, SIGN))
    except StickslipError as error:
        raise StickslipError(f"Contact '{contact.name}' of {mechanism.name}: {error}") from error
    return force, slip, [sympy.diff(slip, q.v) for q in mechanism.coordinates]


class _Terms:
    """Numerical functions of a regressor, generated once."""

    def __init__(
        self,
        mechanism: Mechanism,
        monomials: Sequence[Monomial],
        lagrangian: Parts,
        dissipation: Parts,
        forces: Iterable[tuple[Parts, sympy.Expr, list[sympy.Expr]]],
        applied: Sequence[Parts],
    ) -> None:
        index = {monomial: i for i, monomial in enumerate(monomials)}
        q, v = list(mechanism.coordinates), [coordinate.v for coordinate in mechanism.coordinates]
        self.count = len(q)
        self.inertial = [index[m] for m in lagrangian]
        self.lagrangian = _function([*q, *v], list(lagrangian.values()))
        self.viscous = [index[m] for m in dissipation]
        self.dissipation = _function([*q, *v], list(dissipation.values()))
        self.forces = [
            ([index[m] for m in force], _function([SLIP, SIGN], list(force.values())), _function([*q, *v], [slip, *by]))
            for force, slip, by in forces
        ]
        self.applied = [
            (joint, [index[m] for m in terms], _function([*q, *v], list(terms.values())))
            for joint, terms in enumerate(applied)
            if terms
        ]

    def add_energies(self, matrix: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> None:
        """d/dt dL/dv - dL/dq of each monomial."""
        n = self.count
        # e1 along each velocity, then along each coordinate; e2 along the motion
        unit, none = np.eye(n), np.zeros((n, n))
        along = np.concatenate([np.hstack([none, unit]), np.hstack([unit, none])])  # (2n, q and v)
        zero = np.zeros((1, 1))
        numbers = [
            HyperDual(value[None, :], along[:, row, None], rate[None, :], zero)
            for row, (value, rate) in enumerate(zip((*q.T, *v.T), (*v.T, *a.T), strict=True))
        ]
        for column, energy in zip(self.inertial, self.lagrangian(*numbers), strict=True):
            if isinstance(energy, HyperDual):
                mixed = np.broadcast_to(energy.both, (2 * n, len(q)))[:n]
                first = np.broadcast_to(energy.first, (2 * n, len(q)))[n:]
                matrix[:, :, column] += (mixed - first).T

    def add_friction(self, matrix: np.ndarray, q: np.ndarray, v: np.ndarray, smooth: np.ndarray) -> None:
        """dD/dv, forces of contacts and what else is applied, of each monomial."""
        n = self.count
        along = np.hstack([np.zeros((n, n)), np.eye(n)])
        zero = np.zeros((1, 1))
        numbers = [HyperDual(value[None, :], along[:, row, None], zero, zero) for row, value in enumerate((*q.T, *v.T))]
        for column, power in zip(self.viscous, self.dissipation(*numbers), strict=True):
            if isinstance(power, HyperDual):
                matrix[:, :, column] += np.broadcast_to(power.first, (n, len(q))).T
        plain = (*q.T, *v.T)
        for places, force, slip in self.forces:
            speed, *by = slip(*plain)
            over = sum(np.abs(share) * width for share, width in zip(by, smooth, strict=True))
            sign = np.tanh(speed / over) if np.all(over > 0) else np.sign(speed)
            for column, along_slip in zip(places, force(speed, sign), strict=True):
                for joint, share in enumerate(by):
                    matrix[:, joint, column] -= share * along_slip
        for joint, places, function in self.applied:
            for column, values in zip(places, function(*plain), strict=True):
                matrix[:, joint, column] += values


def _function(arguments: Sequence[sympy.Basic], expressions: Sequence[sympy.Expr]) -> Callable[..., Sequence[Any]]:
    if not expressions:
        return lambda *_: ()
    return sympy.lambdify(arguments, list(expressions), modules=[FUNCTIONS, "numpy"], cse=True)


@dataclass(frozen=True)
class BaseParameter(Shown):
    """A base parameter: the monomial that names it, and the others that it absorbs, with their factors."""

    index: int
    name: str
    unit: str
    others: tuple[tuple[str, float], ...]
    frictional: bool

    @property
    def combination(self) -> str:
        """The combination as text, such as "I1 + 0.04 m2 - 0.2 m1 r1"."""
        terms = []
        for name, factor in self.others:
            times = "" if abs(abs(factor) - 1) < DEPENDENT else f"{abs(factor):.6g} "
            terms.append(f"{'-' if factor < 0 else '+'} {times}{name}")
        return " ".join([self.name, *terms])


@dataclass(frozen=True, eq=False)
class Base:
    """Base parameters (b,); combine (b, m): from all monomials to them; silent: monomials that no effort shows; given:
    column of what is known, if there is any."""

    parameters: tuple[BaseParameter, ...]
    combine: np.ndarray
    silent: tuple[str, ...]
    given: int | None

    @property
    def places(self) -> list[int]:
        """Columns of the base parameters in the regressor."""
        return [parameter.index for parameter in self.parameters]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the monomials after which the base parameters are named."""
        return tuple(parameter.name for parameter in self.parameters)

    def whole(self, values: np.ndarray) -> np.ndarray:
        """Values (m,) of all monomials by those (b,) of the base parameters: 1 for what is given, else 0."""
        monomials = np.zeros(self.combine.shape[1])
        monomials[self.places] = values
        if self.given is not None:
            monomials[self.given] = 1.0
        return monomials


def base_parameters(regressor: Regressor) -> Base:
    """The base parameters of a machine, found by random motion."""
    rng = np.random.default_rng(SEED)
    count = len(regressor.joints)
    samples = max(SAMPLES, 3 * len(regressor.names))
    motion = [rng.uniform(-np.pi, np.pi, (samples, count)), *rng.normal(0.0, 3.0, (2, samples, count))]
    columns = regressor(*motion).reshape(-1, len(regressor.names))
    return _base(regressor, columns)


def _base(regressor: Regressor, columns: np.ndarray) -> Base:
    sizes = np.linalg.norm(columns, axis=0)
    basis = np.zeros((len(columns), 0))
    taken: list[int] = []
    combine = np.zeros((0, columns.shape[1]))
    for index, size in enumerate(sizes):
        if size == 0 or regressor.names[index] == GIVEN:
            continue
        unit = columns[:, index] / size
        residual = unit - basis @ (basis.T @ unit)
        residual -= basis @ (basis.T @ residual)  # once more, for what rounding left
        length = float(np.linalg.norm(residual))
        if length > DEPENDENT:
            basis = np.column_stack([basis, residual / length])
            taken.append(index)
            combine = np.vstack([combine, np.zeros(columns.shape[1])])
            combine[-1, index] = 1.0
        else:
            combine[:, index] = np.linalg.lstsq(columns[:, taken], columns[:, index], rcond=None)[0]
    combine[np.abs(combine) < DEPENDENT] = 0.0
    parameters = tuple(
        BaseParameter(
            index,
            regressor.names[index],
            regressor.units[index],
            tuple((regressor.names[i], float(row[i])) for i in map(int, np.flatnonzero(row)) if i != index),
            bool(regressor.frictional[index]),
        )
        for index, row in zip(taken, combine, strict=True)
    )
    silent = tuple(n for n, size in zip(regressor.names, sizes, strict=True) if size == 0 and n != GIVEN)
    column = regressor.names.index(GIVEN) if GIVEN in regressor.names else None
    return Base(parameters, combine, silent, column)
