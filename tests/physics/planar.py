"""What the tests of planar systems share: Jacobians of a declaration, extremes of a motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy
from closed_form import root

from fmu_models.fmu.fmu import Fmu
from fmu_models.language.automaton import Automaton
from fmu_models.lowering.lower import lower
from fmu_models.simulation.run import simulate


def symbols(model: Automaton) -> dict[str, Any]:
    """States, parameters and signs of switches by name."""
    signs = {f"{switch.name}_sign": switch.sign for switch in model.switches}
    return {q.name: q for q in (*model.states, *model.parameters)} | signs


def jacobian(model: Automaton, **values: Any) -> Any:
    """Derivative of the lowered flow by the states, with values put in: states, parameters, signs by name."""
    system = lower(model)
    known = symbols(model)
    derived = sympy.Matrix(system.acceleration).jacobian(list(system.driven))
    return derived.xreplace({known[name]: sympy.sympify(value) for name, value in values.items()})


def extremes(fmu: Fmu, state: str, stop: float, start: Mapping[str, float]) -> list[float]:
    """Values of a state where its rate changes sign, ascending."""
    times = np.linspace(0.0, stop, 201)

    def motion(name: str, at: np.ndarray) -> np.ndarray:
        return simulate(fmu, stop, start=start, output_times=at)[name]

    def rate(t: float) -> float:
        return float(motion(f"der({state})", np.array([t]))[0])

    rates = motion(f"der({state})", times)
    turns = [root(rate, times[i], times[i + 1]) for i in np.flatnonzero(rates[:-1] * rates[1:] < 0)]
    return sorted(float(x) for x in motion(state, np.array(turns)))
