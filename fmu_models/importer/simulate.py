"""One run of any FMU by the compiled master."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from fmu_models.fmu.fmu import Fmu
from fmu_models.importer import structure
from fmu_models.importer.driver import Driver
from fmu_models.simulation.trajectory import Trajectory


def simulate_any(
    fmu: Fmu | str | os.PathLike[str],
    stop_time: float,
    *,
    method: str = "auto",
    tolerance: float = 1e-8,
    record: Sequence[str] | None = None,
    on_zeno: str = "stop",
    max_step: float | None = None,
    parameters: Mapping[str, float | str | bytes] | None = None,
    **options: Any,
) -> Trajectory:
    """Run an FMU once; ``options`` are those of ``Driver.run``, ``parameters`` may be structural ones too.

    Raises:
        StickslipError: see ``Driver``.
    """
    fmu = fmu if isinstance(fmu, Fmu) else Fmu.open(fmu)
    sizes, others = structure.split(fmu, parameters or {})
    with Driver(
        fmu,
        method=method,
        tolerance=tolerance,
        record=record,
        on_zeno=on_zeno,
        max_step=max_step,
        structural_parameters=sizes,
    ) as driver:
        return driver.run(stop_time, parameters=others, **options)
