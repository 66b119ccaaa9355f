"""A declared map as a system whose states rest, and jump by the rule at equal times."""

from collections.abc import Mapping

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.maps import Map
from fmu_models.language.quantities import Parameter, State
from fmu_models.lowering.hybrid_system import HybridSystem

PERIOD = "period"


def iterated(declared: Map, *, backward: bool = False, period_name: str = PERIOD) -> HybridSystem:
    """The positive or the negative map, with the time from one step to the next as its last parameter. StickslipError:
    the map has a quantity of that name, or no inverse."""
    rule = declared.inverse if backward else declared.rule
    if rule is None:
        raise StickslipError(f"{declared.name} has no inverse: only the positive map can be followed.")
    if period_name in {q.name for q in (*declared.parameters, *declared.states)}:
        raise StickslipError(
            f"{declared.name}: '{period_name}' is what its FMU calls the time from one step to the next. Rename its "
            "own."
        )
    period = Parameter(period_name, 1.0, "s", "time from one step of the map to the next", positive=True)
    return HybridSystem.of(
        declared,
        parameters=(*declared.parameters, period),
        internal_states=tuple(declared.states),  # type: ignore[arg-type]  # states without a law
        internal_rates=tuple(sympy.S.Zero for _ in declared.states),
        rule=rule,
        modulus=declared.modulus,
    )


def iterated_alone(declared: Map, backward: bool = False) -> HybridSystem:
    """The map for runs that ask for no time: whatever its quantities are called, the time of a step has another name.

    Errors as for ``iterated``.
    """
    names = "".join(quantity.name for quantity in (*declared.states, *declared.parameters))
    return iterated(declared, backward=backward, period_name=f"{names}_{PERIOD}")


def differentiated(rule: Mapping[State, sympy.Expr]) -> tuple[list[sympy.Expr], sympy.Expr]:
    """The derivatives of the next states of a rule by the present ones, row by row, and their determinant, cancelled
    beforehand: it survives where a strong stretch leaves nothing of the last difference."""
    # the sign inside a modulus stays a symbol until after differentiation: SymPy differentiates |z| only where it
    # knows z to be real, which it does not know of a quotient, and the determinant cancels only without case
    signs: dict[sympy.Expr, sympy.Dummy] = {}
    smooth = [after.replace(sympy.Abs, lambda z: signs.setdefault(z, sympy.Dummy()) * z) for after in rule.values()]
    jacobian = sympy.Matrix(smooth).jacobian(list(rule))
    cases = {sign: sympy.Piecewise((-1, z < 0), (1, True)) for z, sign in signs.items()}
    return [entry.subs(cases) for entry in jacobian], sympy.expand(jacobian.det()).subs(cases)
