"""One run of one FMU by one tool, for a process of its own: what it is asked for, and the table that comes out.

Conventions of the cross-check archives, for files beside NAME.fmu or in the folder above:

NAME_in.csv                 inputs over time
NAME_ref.csv, NAME_out.csv  values that another tool found
NAME_ref.opt                lines "StartTime,0", "StopTime,10", "StepSize,0.01" (0: free)
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pandas as pd
from fmpy.model_description import ModelDescription

from fmu_models.base.errors import StickslipError
from fmu_models.fmu.elements import element_names
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.driver import Driver
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal

ME, CS = "ModelExchange", "CoSimulation"
OURS, ENGINE, FMPY = "stickslip", "engine", "fmpy"
# what runs: the master; the engine inside an FMU of ours; fmpy
JOBS = ((OURS, ME), (OURS, CS), (FMPY, ME), (FMPY, CS), (ENGINE, ME))
INTERVALS, MOST_ROWS, FEWEST_ROWS = 500, 20_000, 10  # of a run whose step nobody states, or states out of all measure
SIDE = 1e-6  # of the run: as far before and behind each output time a run by Model Exchange is looked at too
FINE, COARSE = 1e-9, 1e-7  # tolerances; of fmpy's two runs the difference says how far it can be trusted
TEXTS = ("String", "Binary", "Clock")


@dataclass(frozen=True)
class Experiment:
    """What both tools are asked for: times in s; inputs and the values of a third tool by column, time in the first."""

    start: float
    stop: float
    step: float
    inputs: pd.DataFrame | None
    reference: pd.DataFrame | None

    @property
    def grid(self) -> np.ndarray:
        """(n,) s, as fmpy counts it."""
        count = round((self.stop - self.start) / self.step)
        return np.minimum(self.start + np.arange(count + 1) * self.step, self.stop)

    @property
    def side(self) -> float:
        """s, within which a jump may be on either side of a row."""
        return SIDE * (self.stop - self.start)

    @classmethod
    def of(cls, path: Path, description: ModelDescription, until: float | None) -> Experiment:
        """By the files beside the FMU, else by what it suggests. StickslipError: its times are none."""
        inputs, reference = (_table(path, *ends) for ends in (("_in.csv",), ("_ref.csv", "_out.csv")))
        opt, stated, times = _beside(path, "_ref.opt"), description.defaultExperiment, {}
        if opt:
            rows = [line.split(",") for line in opt.read_text().splitlines()]
            times = {row[0].strip(): float(row[1]) for row in rows if len(row) == 2}
        suggested = [float(getattr(stated, n, None) or 0) for n in ("startTime", "stopTime", "stepSize")]
        seen = reference.iloc[:, 0] if reference is not None else pd.Series(dtype=float)
        start = times.get("StartTime", seen.min() if seen.size else suggested[0])
        stop = until or times.get("StopTime") or (seen.max() if seen.size else suggested[1] or start + 10.0)
        even = seen.size > 1 and np.allclose(seen.diff()[1:], seen.iloc[1] - seen.iloc[0], rtol=1e-3)
        step = times.get("StepSize") or (float(seen.iloc[1] - seen.iloc[0]) if even else suggested[2])
        if not (np.isfinite([start, stop]).all() and stop > start):
            raise StickslipError(f"a run from {start:g} s to {stop:g} s has no length; give --until SECONDS")
        if not (stop - start) / MOST_ROWS <= step <= (stop - start) / FEWEST_ROWS:
            step = (stop - start) / INTERVALS
        return cls(float(start), float(stop), float(step), inputs, reference)


@dataclass(frozen=True)
class Run:
    """What a tool found: a row per time (in the first column), by variable; ``coarse``: the same at another tolerance.

    Attributes:
        sizes: nominal values that the FMU states, 0 where it states none; units: of the variables, "" where none.
        discrete: those that change by jumps alone.
    """

    experiment: Experiment
    table: pd.DataFrame
    coarse: pd.DataFrame | None = None
    sizes: dict[str, float] | None = None
    units: dict[str, str] | None = None
    discrete: frozenset[str] = frozenset()
    heading: str = ""


def run(path: Path, tool: str, interface: str, until: float | None) -> Run | None:
    """The run of a job; None: the FMU has no such interface. StickslipError: the tool refuses, in its own words."""
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 2)  # what solvers and FMUs print there is for nobody
    os.chdir(tempfile.gettempdir())  # some FMUs write files where they are
    if tool == FMPY:
        try:
            return _by_fmpy(path, interface, until)
        except Exception as error:  # whatever it raises is its refusal
            raise StickslipError(" ".join(str(error).split())[:300] or type(error).__name__) from None
    fmu = Fmu.open(path)
    if not _offers(fmu.description, interface) or (tool == ENGINE and not fmu.ours):
        return None
    asked = Experiment.of(path, fmu.description, until)
    names, inputs = _recorded(fmu.description, asked), dict(_signals(fmu, asked))
    rows = asked.grid if asked.reference is None else np.union1d(asked.grid, asked.reference.iloc[:, 0])
    sides = np.unique(np.clip(rows[:, None] + np.array([-1, 0, 1]) * asked.side, asked.start, asked.stop))
    if tool == ENGINE:
        result = simulate(fmu, asked.stop, start_time=asked.start, inputs=inputs, output_times=sides)
    else:
        options: dict[str, Any] = {"communication_step": asked.step} if interface == CS else {"output_times": sides}
        method = "co-simulation" if interface == CS else "auto"
        with Driver(fmu, method=method, tolerance=FINE, record=names) as driver:
            result = driver.run(asked.stop, start_time=asked.start, inputs=inputs, **options)
    columns = [n for name in names for n in _elements(fmu.description, name) if n in result.values]
    table = pd.DataFrame({"time": result.time, **{name: np.asarray(result[name], float) for name in columns}})
    owners = {n: fmu.variables[name] for name in names for n in _elements(fmu.description, name)}
    return Run(
        asked,
        table,
        sizes={n: abs(float(getattr(v, "nominal", None) or 0)) for n, v in owners.items()},
        units={n: str(v.unit or "") for n, v in owners.items()},
        discrete=frozenset(n for n, v in owners.items() if not _flows(v)),
        heading=f"FMI {fmu.description.fmiVersion}, {fmu.description.generationTool or 'unknown maker'}",
    )


def _by_fmpy(path: Path, interface: str, until: float | None) -> Run | None:
    description = fmpy.read_model_description(str(path), validate=False)
    if not _offers(description, interface):
        return None
    if description.fmiVersion == "1.0" and description.modelExchange:
        description.modelExchange.needsCompletedIntegratorStep = (
            True  # always; fmpy calls it where the attribute says so
        )
    asked = Experiment.of(path, description, until)
    names = _recorded(description, asked)
    known = {v.name for v in description.modelVariables}
    table = asked.inputs
    if table is not None:
        table = table[[column for i, column in enumerate(table) if i == 0 or column in known]]
    rows: Any = None if table is None else table.astype(float).to_records(index=False)
    ramps = description.fmiVersion == "2.0" and bool(getattr(description.coSimulation, "canInterpolateInputs", False))

    def once(tolerance: float, step: float) -> pd.DataFrame:
        result: Any = fmpy.simulate_fmu(
            str(path),
            model_description=description,
            validate=False,
            fmi_type=interface,
            start_time=asked.start,
            stop_time=asked.stop,
            relative_tolerance=tolerance,
            output_interval=step,
            input=rows,
            output=names,
            set_input_derivatives=ramps and interface == CS and table is not None,
        )
        columns = {"time": np.asarray(result["time"], float)}
        for name in names:
            elements = _elements(description, name)
            columns |= zip(elements, np.asarray(result[name], float).reshape(len(result), -1).T, strict=True)
        return pd.DataFrame(columns)

    heading = f"FMI {description.fmiVersion}, {description.generationTool or 'unknown maker'}"
    # its time events move with its rows
    coarse = once(COARSE, asked.step / 2) if interface == ME else None
    return Run(asked, once(FINE, asked.step), coarse, heading=heading)


def _offers(description: ModelDescription, interface: str) -> bool:
    return (description.modelExchange if interface == ME else description.coSimulation) is not None


def _recorded(description: ModelDescription, asked: Experiment) -> list[str]:
    """Numbers among outputs, states, contact states and what the reference has; else whatever changes."""
    states = {u.variable.derivative.name for u in description.derivatives if u.variable and u.variable.derivative}
    wanted = states | set([] if asked.reference is None else asked.reference.columns[1:])
    numbers = [v for v in description.modelVariables if v.type not in TEXTS]
    named = [v for v in numbers if v.causality == "output" or v.name in wanted or str(v.name).endswith("_state")]
    kept = named or [v for v in numbers if v.causality == "local" and v.variability not in ("constant", "fixed")][:50]
    return list(dict.fromkeys(str(v.name) for v in kept))


def _elements(description: ModelDescription, name: str) -> list[str]:
    return element_names(name, next(v for v in description.modelVariables if v.name == name).shape or ())


def _flows(variable: Any) -> bool:
    return variable.type in ("Real", "Float64", "Float32") and variable.variability in (None, "continuous")


def _signals(fmu: Fmu, asked: Experiment) -> Iterator[tuple[str, Signal]]:
    """Inputs as fmpy takes them: lines between rows, levels of what is discrete; both go on at the ends."""
    if asked.inputs is None:
        return
    time = asked.inputs.iloc[:, 0].to_numpy(float)
    for name in asked.inputs.columns[1:]:
        if name in fmu.variables:
            value = asked.inputs[name].to_numpy(float)
            padded = np.r_[min(asked.start, time[0]), time, max(asked.stop, time[-1])]
            values = np.r_[value[0], value, value[-1]]
            yield name, (Signal if _flows(fmu.variables[name]) else Signal.held)(padded, values)


def _beside(path: Path, *ends: str) -> Path | None:
    """Beside the FMU, or one folder up, where both versions of FMI share a file."""
    files = [folder / f"{path.stem}{end}" for folder in (path.parent, path.parent.parent) for end in ends]
    return next((file for file in files if file.is_file()), None)


def _table(path: Path, *ends: str) -> pd.DataFrame | None:
    """The numbers of a CSV file beside the FMU; words true and false are numbers too."""
    file = _beside(path, *ends)
    if file is None:
        return None
    table = pd.read_csv(file, skipinitialspace=True).replace({"true": 1.0, "false": 0.0}).infer_objects()
    table.columns = [str(name).strip().strip('"') for name in table.columns]
    numbers = table.apply(pd.to_numeric, errors="coerce")
    assert isinstance(numbers, pd.DataFrame)
    numbers = numbers.astype(float)
    return numbers.dropna(axis="columns", how="all").dropna()
