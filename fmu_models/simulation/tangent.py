"""Exact derivatives of the end of a motion with respect to where it began and to parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fmu_models.base.arrays import Vector
from fmu_models.base.shown import Shown
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import check_names, check_span
from fmu_models.simulation.sensitivity import SensitiveRun


@dataclass(frozen=True, eq=False)
class FlowDerivative(Shown):
    """Where a motion arrives, and how that depends on where it began.

    Attributes:
        states: names of the states, in the order of rows and columns below; of a motion that was given the speed at
            which it had entered a stop, also the memories of these.
        end: (n,) states at the end.
        by_start: (n, n) d end / d start; over a period of a periodic motion its monodromy matrix.
        by_parameter: per parameter asked for (n,) d end / d parameter, start states held.
        one_sided: the motion passes a corner, as for ``Sensitivity``.
    """

    states: tuple[str, ...]
    end: Vector
    by_start: Vector
    by_parameter: Mapping[str, Vector]
    one_sided: bool = False


def flow_derivative(
    fmu: Fmu,
    stop_time: float,
    *,
    start_time: float = 0.0,
    parameters: Mapping[str, float] | None = None,
    start: Mapping[str, float] | None = None,
    inputs: Mapping[str, Any] | None = None,
    by: Sequence[str] = (),
    tolerance: float = 1e-14,
) -> FlowDerivative:
    """End states of a run and their derivatives.

    Args:
        parameters, start, inputs: as for ``simulate``.
        by: parameters to differentiate by.

    Raises:
        StickslipError: as for ``simulate``; or the motion has no derivative, because it touches the bound of a contact
            without crossing it.
    """
    check_span(start_time, stop_time)
    check_names(fmu, "parameter", dict.fromkeys(by), fmu.parameters)
    states = (*fmu.states, *(name for name in fmu.memories if name in (start or {})))
    with SensitiveRun(fmu, by=[*states, *by], recorded=states, tolerance=tolerance) as sensitive_run:
        sensitivity = sensitive_run.run(
            [stop_time], start_time=start_time, parameters=parameters, start=start, inputs=inputs
        )
    end, derivative, n = sensitivity.values[0], sensitivity.derivative[0], len(states)
    by_parameter = dict(zip(by, derivative[:, n:].T.copy(), strict=True))
    return FlowDerivative(states, end, derivative[:, :n].copy(), by_parameter, sensitivity.one_sided)
