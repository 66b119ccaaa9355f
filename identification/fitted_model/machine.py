"""A machine with what logs said of it: its declaration in base parameters, at their values.

    T = sum_k theta_k dT/dtheta_k,  U, D and applied forces likewise;    theta_k base parameters, the others 0

What other monomials add to the efforts is in the base parameters that took them up, so the motion is the fit's.
"""

import dataclasses
import re
from collections.abc import Mapping

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.friction import Friction
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Parameter
from identification.machines.linear_parts import NOTHING, Monomial, linear_parts, monomial_name, monomial_unit
from identification.machines.machine_fit import MachineFit
from identification.machines.regressor import SIGN, SLIP, effort_inputs, substituted


def machine_with(mechanism: Mechanism, fit: MachineFit) -> Mechanism:
    """The mechanism of a fit with parameters "J1", "m2_r2", ... that are its base parameters at their values, and with
    what was known; for ``load``, ``simulate``, ``export``. Outputs and requirements, which speak of single parameters,
    are left out, and contacts without friction.

    Raises:
        StickslipError: the fit is of another machine or has friction that drives; or a law holds products of what was
            to be found.
    """
    result = _BaseForm(mechanism, fit)
    efforts = zip(mechanism.coordinates, effort_inputs(mechanism), strict=True)
    return Mechanism(
        name=f"{mechanism.name}_found",
        title=f"{mechanism.title}, as logs show it",
        source=f"{mechanism.source}; values by {fit.method}",
        coordinates=mechanism.coordinates,
        kinetic_energy=result.expression(mechanism.kinetic_energy),
        potential_energy=result.expression(mechanism.potential_energy),
        dissipation=result.expression(mechanism.dissipation),
        applied={q: effort + result.expression(mechanism.applied[q] - effort) for q, effort in efforts},
        contacts=[contact for friction in mechanism.frictions if (contact := result.contact(friction)) is not None],
    )


def identifier(name: str) -> str:
    """The name of a base parameter in declarations: "m2_r2" for "m2 r2"."""
    return re.sub(r"\W", "_", name, flags=re.ASCII)


class _BaseForm:
    """Expressions of a declaration in base parameters."""

    def __init__(self, mechanism: Mechanism, fit: MachineFit) -> None:
        self.name = mechanism.name
        self.values = {parameter.name: parameter for parameter in fit.parameters}
        self.unknown = {p for p in mechanism.parameters if p.name not in fit.known}
        self.given: dict[Parameter, sympy.Expr] = {
            p: Parameter(p.name, fit.known[p.name], p.unit, p.description)
            for p in mechanism.parameters
            if p.name in fit.known
        }
        self.known: dict[Parameter, sympy.Expr] = {p: sympy.Float(fit.known[p.name]) for p in self.given}
        laws = [sympy.sympify(friction.law.force(SLIP, SIGN)) for friction in mechanism.frictions]
        energies = (mechanism.kinetic_energy, mechanism.potential_energy, mechanism.dissipation)
        sums = [linear_parts(energy, self.unknown) for energy in (*energies, *mechanism.applied.values(), *laws)]
        monomials = {monomial_name(monomial): monomial for terms in sums for monomial in terms}
        if fit.machine != mechanism.name or not monomials.keys() >= self.values.keys():
            raise StickslipError(f"The fit is of '{fit.machine}', and not of {mechanism.name} as it is declared now.")
        # in the order of the fit
        self.parameters = {monomials[name]: self._parameter(monomials[name]) for name in self.values}

    def expression(self, expression: sympy.Expr) -> sympy.Expr:
        """An energy or a force."""
        terms = linear_parts(expression, self.unknown).items()
        coefficients: dict[Monomial, sympy.Expr] = {**self.parameters, NOTHING: sympy.S.One}
        summands = [coefficients[monomial] * motion for monomial, motion in terms if monomial in coefficients]
        return substituted(sympy.Add(*summands), self.given)

    def _parameter(self, monomial: Monomial) -> Parameter:
        """A base parameter; friction that the declaration bounds stays bounded."""
        p = self.values[monomial_name(monomial)]
        minimum = monomial[0][0].minimum if p.frictional and len(monomial) == 1 else None
        if minimum is not None and p.value < minimum:
            raise StickslipError(
                f"{p.combination} = {p.value:.4g} {p.unit} is friction that drives: no machine moves so. "
                f"Identify it with {monomial[0][0].name} = 0 as known."
            )
        return Parameter(
            identifier(p.name), p.value, monomial_unit(monomial), p.meaning or p.combination, minimum=minimum
        )

    def contact(self, contact: Friction) -> Friction | None:
        """A contact; None where the fit has no friction for it."""
        terms = linear_parts(sympy.sympify(contact.law.force(SLIP, SIGN)), self.unknown)
        constant = substituted(terms.pop(NOTHING, sympy.S.Zero), self.known)
        if constant == 0 and not terms.keys() & self.parameters.keys():
            return None
        at: dict[sympy.Basic, sympy.Basic] = {**self.given, **dict.fromkeys(self.unknown, sympy.S.Zero)}
        for monomial in terms:
            if len(monomial) != 1 or monomial[0][1] != 1:
                raise StickslipError(
                    f"The law of contact '{contact.name}' of {self.name} holds {monomial_name(monomial)}, which cannot "
                    "be parted again. Identify the machine with all but one of them as known."
                )
            if monomial in self.parameters:
                at[monomial[0][0]] = self.parameters[monomial]
        return dataclasses.replace(contact, slip=substituted(contact.slip, self.given), law=_at(contact.law, at))


def _at(value: object, at: Mapping[sympy.Basic, sympy.Basic]) -> object:
    """Whatever a law is made of, with these in place: expressions, tuples, laws inside laws."""
    if isinstance(value, sympy.Basic):
        return value.xreplace(at)
    if isinstance(value, tuple):
        return tuple(_at(item, at) for item in value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = [field.name for field in dataclasses.fields(value) if field.init]
        return dataclasses.replace(value, **{name: _at(getattr(value, name), at) for name in fields})
    return value
