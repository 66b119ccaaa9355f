"""Units that refuse their steps or die in one: a sentence with their names, and what ran until then."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coupled import exported, wires
from models import foreign
from typer.testing import CliRunner
from whole_application import app

from fmu_models.base.child_process import Limits
from fmu_models.base.errors import StickslipError
from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.motion_error import MotionError
from fmu_models.importer.simulate import simulate_any

UNTIL = 0.5  # where the unit does its harm


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("harm")
    foreign("harm", made)
    exported("mass", made)
    return made


def _system(folder: Path, harm: float, **settings: Any) -> CoupledSystem:
    """x' = place of a mass that swings as cos(2 t)."""
    mass = Unit(exported("mass", folder), {"kc": 0.0}, {"x": 1.0})
    units = {"sum": Unit(Fmu.open(folder / "harm2.fmu"), {"harm": harm}), "mass": mass}
    settings = {"solver": "co-simulation", "tolerance": 1e-6, "stop_time": 1.0, **settings}
    return CoupledSystem("harmed", units, wires("mass.place -> sum.u"), **settings)


def _check_kept(error: MotionError, last: float) -> None:
    assert error.so_far is not None
    times = error.so_far.time
    assert times[-1] == pytest.approx(last, abs=1e-7)
    assert error.so_far["sum.x"] == pytest.approx(np.sin(2.0 * times) / 2.0, abs=3e-6)
    assert error.so_far.units["mass.place"] == "m"


def test_a_unit_that_refuses_ever_shorter_steps(folder: Path) -> None:
    with pytest.raises(MotionError, match=r"unit 'sum': discards the .* step of .* at t = 0\.\d+ s\..* 12 longer ones"):
        couple(_system(folder, 0.0))
    with pytest.raises(MotionError) as caught:
        couple(_system(folder, 0.0))
    assert caught.value.kind == "discard"
    _check_kept(caught.value, UNTIL)


@pytest.mark.parametrize("settings", [{"step": 0.01}, {"rollback": False}])
def test_a_unit_that_refuses_a_step_that_is_not_repeated(folder: Path, settings: dict[str, Any]) -> None:
    with pytest.raises(MotionError, match=r"unit 'sum': discards the communication step") as caught:
        couple(_system(folder, 0.0, **settings))
    assert caught.value.so_far is not None
    assert 0.3 < caught.value.so_far.time[-1] <= UNTIL


@pytest.mark.skipif(sys.platform != "linux", reason="signals")
def test_a_unit_that_dies_in_a_step_of_its_process(folder: Path) -> None:
    shown: list[float] = []
    with pytest.raises(
        MotionError, match=r"unit 'sum', in its step behind t = 0\.\d+ s: It crashed \(SIGSEGV"
    ) as caught:
        couple(_system(folder, 1.0, step=0.01), limits=Limits(100), progress=shown.append)
    # the last point may have been replaced by an event
    _check_kept(caught.value, UNTIL - 0.01)
    assert shown == sorted(shown)
    assert shown[-1] == pytest.approx(UNTIL)


def test_a_process_of_its_own_changes_no_bit(folder: Path) -> None:
    system = _system(folder, 0.0, stop_time=0.4)
    here, there = couple(system), couple(system, limits=Limits(100))
    assert here.method == there.method
    for name, values in here.values.items():
        assert np.array_equal(there[name], values), name
    as_one = CoupledSystem("mass", {"mass": system.units["mass"]}, solver="dop853", stop_time=0.4)
    assert np.array_equal(couple(as_one)["mass.x"], couple(as_one, limits=Limits(100))["mass.x"])


@pytest.mark.skipif(sys.platform != "linux", reason="signals")
@pytest.mark.parametrize("harm", [0, 1])
def test_the_command_writes_what_ran(folder: Path, harm: int) -> None:
    system, kept = folder / "harmed.toml", folder / f"kept{harm}.csv"
    system.write_text(
        "connections = [{ from = 'mass.place', to = 'sum.u' }]\nsolver = 'co-simulation'\nstop_time = 1.0\n"
        f"[units.sum]\nfmu = 'harm2.fmu'\nparameters = {{ harm = {harm} }}\n"
        "[units.mass]\nfmu = 'mass3.0.fmu'\nstart = { x = 1.0 }\n"
    )
    done = CliRunner().invoke(app, ["couple", str(system), "-o", str(kept), "--isolate", "--json"])
    assert isinstance(done.exception, StickslipError), done.output
    assert "unit 'sum'" in str(done.exception)
    assert f"What ran until then is in '{kept}'" in str(done.exception)
    rows = kept.read_text("utf-8").splitlines()
    assert rows[0].startswith("time [s],")
    assert 0.2 < float(rows[-1].partition(",")[0]) <= UNTIL
    with pytest.raises(json.JSONDecodeError):
        json.loads(done.stdout)


def test_a_loop_without_a_solution_at_the_start_of_a_co_simulation(folder: Path) -> None:
    fmu = exported("link", folder)
    units = {"a": Unit(fmu, {"g": 1.0}), "b": Unit(fmu, {"g": 1.0})}
    system = CoupledSystem("loop", units, wires("a.y -> b.u", "b.y -> a.u"), solver="co-simulation", stop_time=1.0)
    with pytest.raises(MotionError, match=r"at t = 0 s: the algebraic loop .*a\.y -> b\.u.* has no solution") as caught:
        couple(system)
    assert caught.value.so_far is None


def test_a_single_fmu_that_fails_keeps_what_ran(folder: Path) -> None:
    fmu = Fmu.open(foreign("fatal", folder))
    with pytest.raises(MotionError, match="fails for good") as caught:
        simulate_any(fmu, 2.0, tolerance=1e-8, output_times=np.linspace(0.0, 2.0, 21))
    assert caught.value.so_far is not None
    times = caught.value.so_far.time
    assert 0.5 < times[-1] <= 1.0
    assert caught.value.so_far["x"] == pytest.approx(np.exp(-times), rel=1e-6)
