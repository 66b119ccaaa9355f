"""Tools of others open our FMUs and agree with our own run: pathsim-fmi in all four modes, cofmupy in its two."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate

# a stick-slip motion with inputs, a compliant stop, bounces; end of the run, s
MODELS = {"disc_rig": 3.0, "discontinuous_support": 3.0, "bouncing_ball": 2.0}
STEP = 1 / 256  # s, exact in binary
SPEED = 0.41  # rad/s, of all inputs
VERSIONS = ("2.0", "3.0")


@pytest.fixture(scope="module", params=list(itertools.product(MODELS, VERSIONS)), ids="-".join)
def case(request: pytest.FixtureRequest) -> tuple[Path, Fmu, float]:
    model, version = request.param
    path = built(model, fmi_version=version)
    return path, Fmu.open(path), MODELS[model]


def outputs(fmu: Fmu) -> list[str]:
    return [name for name, v in fmu.variables.items() if v.causality == "output"]


def distance(fmu: Fmu, times: np.ndarray, found: np.ndarray) -> float:
    """Largest difference of (n_outputs, n) from our own run, relative to the size of each output; forces jump at an
    event, and a sample within a microsecond of one may be of either side."""
    run = simulate(fmu, times[-1], inputs=dict.fromkeys(fmu.inputs, SPEED), output_times=times)
    assert run.events
    events = np.array([event.time for event in run.events])
    clear = np.abs(times[:, None] - events).min(axis=1) > 1e-6
    ours = np.array([run[name] for name in outputs(fmu)])
    size = np.maximum(1.0, np.abs(ours).max(axis=1, keepdims=True))
    return float((np.abs(found - ours) / size)[:, clear].max())


@pytest.mark.parametrize("co_simulates", [False, True], ids=["ME", "CS"])
def test_pathsim(case: tuple[Path, Fmu, float], co_simulates: bool) -> None:
    blocks = pytest.importorskip("pathsim_fmi", reason="the extra 'interop' is not installed: pip install .[interop]")
    pathsim = pytest.importorskip("pathsim")
    path, fmu, stop = case
    block = blocks.CoSimulationFMU(str(path), dt=STEP) if co_simulates else blocks.ModelExchangeFMU(str(path))
    sources = [pathsim.blocks.Constant(SPEED) for _ in fmu.inputs]
    scope = pathsim.blocks.Scope()
    wires = [pathsim.Connection(source, block[i]) for i, source in enumerate(sources)]
    wires += [pathsim.Connection(block[i], scope[i]) for i in range(len(outputs(fmu)))]
    options: dict[str, Any] = {"tolerance_lte_abs": 1e-9, "tolerance_lte_rel": 1e-9, "dt": STEP, "dt_max": STEP}
    solver = pathsim.solvers.RKDP54
    simulation = pathsim.Simulation([block, scope, *sources], wires, Solver=solver, log=False, **options)
    simulation.run(stop, adaptive=not co_simulates)
    times, values = scope.read()
    # its co-simulation shows at t what was reached by the step from t
    times = np.asarray(times) + (STEP if co_simulates else 0.0)
    once = np.append(np.diff(times) > 1e-12, True) & (times <= stop)
    error = distance(fmu, times[once], np.asarray(values)[:, once])
    assert error < (1e-11 if co_simulates else 1e-7)


def test_cofmupy(case: tuple[Path, Fmu, float]) -> None:
    # its coordinator asks numpy for the least of step sizes that are texts: no FMU that suggests one gets through
    wrappers = pytest.importorskip(
        "cofmupy.wrappers",
        reason="it pins other versions of fmpy and networkx: pip install --no-deps cofmupy confluent-kafka",
        exc_type=ImportError,
    )
    path, fmu, stop = case
    handler = wrappers.FmuHandlerFactory(str(path))()
    inputs = {name: [SPEED] for name in fmu.inputs}
    handler.set_variables(inputs)
    handler.reset()
    times = np.arange(STEP, stop + STEP / 2, STEP)
    rows = [handler.step(time - STEP, STEP, inputs) for time in times]
    found = np.array([[row[name][0] for row in rows] for name in outputs(fmu)])
    assert distance(fmu, times, found) < 1e-11
