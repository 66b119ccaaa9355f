"""One run of any model: by the engine of our own FMUs, or by the compiled master."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load
from fmu_models.importer import structure
from fmu_models.importer.driver import Driver
from fmu_models.simulation import run
from fmu_models.simulation.trajectory import Trajectory

if TYPE_CHECKING:
    from fmu_models.codegen.package import Model

OF_DRIVER = ("method", "tolerance", "record", "on_zeno", "max_step")
OF_MASTER = (*OF_DRIVER[2:], "communication_step", "first_step")


def simulate(model: Fmu | Model, stop_time: float, *, method: str | None = None, **options: Any) -> Trajectory:
    """Run any model from ``start_time`` (0 s unless given) to ``stop_time`` (s).

    Args:
        model: an Fmu, or what ``load`` takes: a name, a declaration, a file, the .fmu file of anybody.
        method: of the master, as for ``Driver``; None: the engine inside an FMU of this suite, "auto" for another one.
        options: start_time, parameters, start, output_times, tolerance, progress; ``inputs``, per input a constant, or
            what changes with time: a Signal, a column "log.csv:speed" of a log, times and values, a pandas Series, a
            function of time. The master takes those of ``Driver`` and ``Driver.run`` too.

    Raises:
        StickslipError: unknown model, name or option, a value that does not do, or a motion that cannot be continued.
    """
    fmu = model if isinstance(model, Fmu) else load(model)
    if not fmu.ours or method is not None:
        return simulate_any(fmu, stop_time, method=method or "auto", **options)
    for option in OF_MASTER:
        if option in options:
            raise StickslipError(
                f"'{option}' belongs to the master; '{fmu.path.name}' runs by its own engine. Leave it out, or name a "
                'method, such as method="auto".'
            )
    return run.simulate(fmu, stop_time, **options)


def simulate_any(
    fmu: Fmu | str | os.PathLike[str],
    stop_time: float,
    *,
    parameters: Mapping[str, float | str | bytes] | None = None,
    **options: Any,
) -> Trajectory:
    """Run an FMU once; ``options`` are those of ``Driver`` and of ``Driver.run``, ``parameters`` may be structural too.

    Errors as for ``Driver``.
    """
    fmu = fmu if isinstance(fmu, Fmu) else Fmu.open(fmu)
    sizes, others = structure.split(fmu, parameters or {})
    of_driver = {name: options.pop(name) for name in OF_DRIVER if name in options}
    with Driver(fmu, structural_parameters=sizes, **of_driver) as driver:
        return driver.run(stop_time, parameters=others, **options)
