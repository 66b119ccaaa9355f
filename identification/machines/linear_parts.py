"""An expression as a sum over monomials of parameters, each times what the motion makes of it.

    m2 (l^2 v1^2/2 + l r2 v1 v2 cos q2)  ->  {m2: l^2 v1^2/2, m2 r2: l v1 v2 cos q2},   l known

Products are multiplied out only as far as parameters reach; what holds none stays as it was written, so that nothing
grows with the number of links.
"""

from collections.abc import Set
from functools import reduce

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.base.unit_names import base_units
from fmu_models.language.derivatives import Derivatives
from fmu_models.language.quantities import Parameter

Monomial = tuple[tuple[Parameter, int], ...]
Parts = dict[Monomial, sympy.Expr]
NOTHING: Monomial = ()
SYMBOLS = {"kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K", "radian": ""}


def linear_parts(expression: sympy.Expr, unknown: Set[sympy.Basic]) -> Parts:
    """The factor of each monomial of the ``unknown`` parameters, as a function of the motion. StickslipError: a
    parameter stands in a function, a denominator or a fractional power."""
    return _parts(expression, unknown, Derivatives())


def _parts(expression: sympy.Expr, unknown: Set[sympy.Basic], shared: Derivatives) -> Parts:
    """shared: knows the symbols of every part, which SymPy would gather anew for each."""
    unknowns = shared.symbols(expression) & unknown
    if not unknowns:
        return {NOTHING: expression}
    if isinstance(expression, Parameter):
        return {((expression, 1),): sympy.S.One}
    if isinstance(expression, sympy.Add):
        sums: Parts = {}
        for summand in expression.args:
            for monomial, motion in _parts(summand, unknown, shared).items():
                sums[monomial] = sums.get(monomial, sympy.S.Zero) + motion
        return sums
    if isinstance(expression, sympy.Mul):
        return reduce(_product, (_parts(arg, unknown, shared) for arg in expression.args))
    if isinstance(expression, sympy.Pow) and expression.exp.is_Integer and expression.exp > 0:
        return reduce(_product, [_parts(expression.base, unknown, shared)] * int(expression.exp))
    names = ", ".join(sorted(str(symbol.name) for symbol in unknowns))  # type: ignore[attr-defined]
    raise StickslipError(
        f"'{sympy.sstr(expression)}' is not linear in {names} or in products of parameters: what is to be found must "
        f"stand outside functions and denominators. Take {names} as known."
    )


def _product(left: Parts, right: Parts) -> Parts:
    product: Parts = {}
    for a, x in left.items():
        for b, y in right.items():
            powers: dict[Parameter, int] = dict(a)
            for parameter, power in b:
                powers[parameter] = powers.get(parameter, 0) + power
            monomial = tuple(sorted(powers.items(), key=lambda pair: pair[0].declared))
            product[monomial] = product.get(monomial, sympy.S.Zero) + x * y
    return product


def monomial_name(monomial: Monomial) -> str:
    """The name of a monomial, such as "m2 r2" or "m1 r1^2"."""
    return " ".join(p.name if power == 1 else f"{p.name}^{power}" for p, power in monomial) or "1"


def monomial_unit(monomial: Monomial) -> str:
    """Unit of a parameter, or that of a product in SI base units."""
    if len(monomial) == 1 and monomial[0][1] == 1:
        return monomial[0][0].unit
    exponents: dict[str, float] = {}
    for parameter, power in monomial:
        for name, exponent in base_units(parameter.unit).powers:
            exponents[name] = exponents.get(name, 0.0) + power * exponent
    named = {SYMBOLS.get(name, name): exponent for name, exponent in exponents.items() if exponent}
    return (
        " ".join(f"{name}{'' if exponent == 1 else f'{exponent:g}'}" for name, exponent in named.items() if name) or "1"
    )
