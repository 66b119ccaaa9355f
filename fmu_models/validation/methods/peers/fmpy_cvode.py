"""fmpy with CVode: the FMU's Model Exchange face under a multistep method, states events by its indicators.

Source: the FMPy project (github.com/CATIA-Systems/FMPy); Hindmarsh et al., SUNDIALS, ACM Transactions on Mathematical
Software 31 (2005), for CVode.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, final

import numpy as np

from fmu_models.fmu.fmu import Fmu
from fmu_models.validation.methods.result import MethodProblem, MethodRun, NotTreated, needs_steady_inputs


@final
@dataclass(frozen=True)
class FmpyCvode:
    """fmpy's ``simulate_fmu`` with its CVode."""

    name: str = "fmpy CVode, Model Exchange"
    family: Literal["event-driven"] = "event-driven"
    tolerances: tuple[float, ...] = (1e-6, 1e-8)

    def prepare(self, problem: MethodProblem) -> Callable[[float], MethodRun]:
        from fmpy import simulate_fmu

        needs_steady_inputs(problem, self.name)
        fmu = Fmu.open(problem.fmu)
        start_values = {**problem.arguments["parameters"], **problem.arguments["start"], **problem.arguments["inputs"]}

        def run(tolerance: float) -> MethodRun:
            started = time.perf_counter()
            try:
                result: Any = simulate_fmu(
                    str(fmu.folder), start_time=0.0, stop_time=problem.stop_time, solver="CVode",
                    fmi_type="ModelExchange", relative_tolerance=tolerance, start_values=start_values,
                    output_interval=problem.stop_time, output=list(problem.states), record_events=False,
                    model_description=fmu.description, validate=False,
                )  # fmt: skip
            except Exception as error:  # fmpy raises plain exceptions
                raise NotTreated(f"fmpy stopped: {error}") from error
            seconds = time.perf_counter() - started
            return MethodRun(np.array([float(result[name][-1]) for name in problem.states]), None, None, seconds)

        return run
