"""A declared map as a system whose states rest, and jump by the rule at equal times."""

from __future__ import annotations

import sympy

from fmu_models.base.errors import StickslipError
from fmu_models.language.maps import Map
from fmu_models.language.quantities import Parameter
from fmu_models.lowering.hybrid_system import HybridSystem

PERIOD = "period"


def iterated(declared: Map) -> HybridSystem:
    """The positive map, with the time from one step to the next as its last parameter.

    Raises:
        StickslipError: the map has a quantity of that name.
    """
    if PERIOD in {q.name for q in (*declared.parameters, *declared.states)}:
        raise StickslipError(
            f"{declared.name}: '{PERIOD}' is what its FMU calls the time from one step to the next. Rename its own."
        )
    period = Parameter(PERIOD, 1.0, "s", "time from one step of the map to the next", positive=True)
    empty = sympy.ImmutableSparseMatrix(0, 0, [])
    return HybridSystem(
        name=declared.name,
        title=declared.title,
        source=declared.source,
        parameters=(*declared.parameters, period),
        inputs=(),
        coordinates=(),
        driven=(),
        rate_symbols=(),
        internal_states=tuple(declared.states),  # type: ignore[arg-type]  # states without a law
        acceleration=(),
        W=empty,
        G=empty,
        constant_inertia=True,
        contacts=(),
        internal_rates=tuple(sympy.S.Zero for _ in declared.states),
        kinetic_energy=sympy.S.Zero,
        outputs=(),
        all_requirements=declared.all_requirements,
        rule=declared.rule,
        modulus=declared.modulus,
    )
