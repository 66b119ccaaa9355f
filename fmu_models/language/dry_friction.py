"""What all set-valued friction laws without internal states have in common."""

from abc import abstractmethod
from dataclasses import MISSING, fields
from typing import Any, ClassVar, Self

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.contacts import Law, Requirement
from fmu_models.language.law_parameter import LawParameter, parameters_of
from fmu_models.language.quantities import Parameter


class DryFriction(Law):
    """lambda = -magnitude(|v|) sgn(v) in slip, |lambda| < magnitude(0) in stick."""

    sticks: ClassVar[bool] = True
    label: ClassVar[str] = ""
    """What people call the law; the name of its class if empty."""
    spans: ClassVar[str] = ""
    """The parameter that is the greatest slip speed of logs, of a curve that is free of any form."""

    @classmethod
    def around(cls, own: object, suffix: str = "") -> Self:
        """The law in place of a contact's ``own``: see `parts_around`."""
        return cls(**parts_around(cls, own, suffix))

    @abstractmethod
    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        """Friction force, N, for a slip speed without sign, m/s."""

    def towards(self, speed: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force, N, for a slip speed without sign and its sign: of most laws the same for both."""
        return self.magnitude(speed)

    @property
    def capacity(self) -> sympy.Expr:
        """Largest force in stick, N."""
        return self.magnitude(sympy.S.Zero)

    def force(self, slip: sympy.Expr, sign: sympy.Expr) -> sympy.Expr:
        """Friction force along positive slip, N."""
        return -sign * self.magnitude(sign * slip)


def parts_around(law: type[Any], own: object, suffix: str) -> dict[str, Any]:
    """What a class of laws is made of in place of a contact's ``own``, by field: parts of one name stay (the normal
    force above all), others become parameters ``<name><suffix>`` as declared, or have the default of their field.
    StickslipError: a part that ``own`` lacks is not declared."""
    declared, values = {entry.name: entry for entry in parameters_of(law)}, {}
    for entry in fields(law):
        if hasattr(own, entry.name):
            values[entry.name] = getattr(own, entry.name)
        elif entry.name in declared:
            values[entry.name] = _parameter(declared[entry.name], suffix)
        elif entry.default is not MISSING or entry.default_factory is not MISSING:
            continue
        else:
            raise StickslipError(
                f"The law '{law.__name__}' has a part '{entry.name}' that its contact's own law does not have. Give it "
                "its unit and meaning: field(metadata=declared(...)); or declare the law in the model."
            )
    return values


def _parameter(declared: LawParameter, suffix: str) -> Parameter:
    return Parameter(
        f"{declared.name}{suffix}",
        declared.value,
        declared.unit,
        declared.description,
        positive=declared.minimum > 0,
        minimum=0.0 if declared.minimum == 0 else None,
    )


def fixed_factors(force: sympy.Expr) -> sympy.Expr:
    """The factors that parameters alone decide: one that changes along the motion cannot be judged before it."""
    factors = sympy.Mul.make_args(sympy.sympify(force))
    return sympy.Mul(*(factor for factor in factors if factor.atoms(Parameter) == factor.free_symbols))


def falling(mu_s: sympy.Expr, mu_k: sympy.Expr, name: str) -> Requirement:
    """Friction falls with the slip speed: with mu_k > mu_s a contact could neither stick nor slip."""
    return Requirement(
        mu_s - mu_k,
        f"{mu_k} exceeds {mu_s}: {name}'s law needs mu_s >= mu_k",
        warning="mu_s = {mu_s:.4g} is less than mu_k = {mu_k:.4g}: friction rises with slip speed, which the {law} law "
        "does not mean. A law with a viscous term (Coulomb+viscous) is more likely right; check also the signs of "
        "the signals.",
    )


def falling_over(v_s: sympy.Expr) -> Requirement:
    """The speed over which friction falls is one."""
    sentence = f"{v_s} must be positive: it is the speed over which friction falls"
    return Requirement(sympy.sympify(v_s), sentence, strict=True)


def braking(mu_v: sympy.Expr) -> Requirement:
    """Viscous friction drives nothing."""
    return Requirement(sympy.sympify(mu_v), f"{mu_v} is negative: viscous friction brakes")
