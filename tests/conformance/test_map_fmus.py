"""Every declared map as an FMU: its steps at time events are those of the declared map, to the last digit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import FMI_VERSIONS, export_map
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.simulate import simulate_any
from fmu_models.language.maps import Map
from fmu_models.language.quantities import Parameter, State
from fmu_models.maps import MAPS
from fmu_models.sections.iteration import Iteration, iterate

STEPS, PERIOD = 40, 0.1
# a version each, in turn: what differs between them is the same for all maps
CASES = [(name, FMI_VERSIONS[i % 2]) for i, name in enumerate(MAPS.members())]


@pytest.fixture(scope="module", params=CASES, ids=[f"{name}-fmi{version[0]}" for name, version in CASES])
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray]:
    """The FMU of a map, and the states that the declared map goes through from its start."""
    declared = MAPS.load(request.param[0])
    path = tmp_path_factory.mktemp("map") / "map.fmu"
    export_map(declared, path, values={"period": PERIOD}, fmi_version=request.param[1])
    system = Iteration.of(declared)
    return path, iterate(system, system.start(), STEPS)


def test_checkers_find_no_problem(case: tuple[Path, np.ndarray]) -> None:
    assert validate_fmu(str(case[0])) == []


@pytest.mark.parametrize("method", ["auto", "co-simulation"])
def test_the_master_makes_every_step(case: tuple[Path, np.ndarray], method: str) -> None:
    path, expected = case
    fmu = Fmu.open(path)
    between = (np.arange(STEPS) + 0.5) * PERIOD
    step = PERIOD / 2 if method == "co-simulation" else None
    run = simulate_any(fmu, STEPS * PERIOD, method=method, output_times=between, communication_step=step)
    for i, name in enumerate(fmu.outputs):
        np.testing.assert_array_equal(run[name], expected[:STEPS, i])


@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
def test_fmpy_makes_every_step(case: tuple[Path, np.ndarray], kind: str) -> None:
    path, expected = case
    # of a time event it records both sides, and a step of Co-Simulation that ends at one has made it
    run = simulate_fmu(str(path), fmi_type=kind, stop_time=STEPS * PERIOD, output_interval=PERIOD)
    last = {round(float(row["time"]) / PERIOD): row for row in run}
    for i, name in enumerate((run.dtype.names or ())[1:]):
        np.testing.assert_array_equal([last[k][name] for k in range(STEPS + 1)], expected[:, i])


def test_a_motion_that_leaves_every_bound_says_when(tmp_path: Path) -> None:
    path = export_map(MAPS.load("henon"), tmp_path / "henon.fmu", values={"a": 100.0})
    with pytest.raises(StickslipError, match="the rule gives state 0 no finite value"):
        simulate_any(Fmu.open(path), 50.0, method="co-simulation", communication_step=1.0)


def test_a_map_with_a_period_of_its_own_is_refused(tmp_path: Path) -> None:
    period = Parameter("period", 2.0, "1", "of something else")
    x = State("x", "1", "state")
    own = Map(name="own", title="Own", source="none", states=[x], rule={x: period * x}, box={x: (0.0, 1.0)})
    with pytest.raises(StickslipError, match="'period' is what its FMU calls the time"):
        export_map(own, tmp_path / "own.fmu")
    assert not list(tmp_path.iterdir())
