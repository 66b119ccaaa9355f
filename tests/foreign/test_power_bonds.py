"""Energy at power bonds, and units that step at the same time: against closed forms, and bit by bit."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from coupled import exported, masses, wires
from quick_export import quick_export

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.coupling.run import couple
from fmu_models.coupling.system import CoupledSystem, Unit
from fmu_models.coupling.toml_system import read_system
from fmu_models.coupling.unit import SteppedUnit
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.automaton import Automaton
from fmu_models.language.declaration import Output
from fmu_models.language.quantities import Input, Parameter, State

RISE, MASS, TWIST = 3.0, 1.5, 2.0


def _ends() -> tuple[Automaton, Automaton]:
    """A force F = r t on a mass, m v' = F; a torque that turns with it, which the other side turns round."""
    r, m = Parameter("r", RISE, "N/s", "rise of the force"), Parameter("m", MASS, "kg", "mass")
    f, s, v = State("F", "N", "force"), State("s", "m", "way"), State("v", "m/s", "speed")
    w, turned = State("w", "rad/s", "speed"), State("phi", "rad", "angle")
    speed, spin = Input("v", 0.0, "m/s", "speed"), Input("w", 0.0, "rad/s", "speed")
    force, torque = Input("force", 0.0, "N", "force"), Input("torque", 0.0, "N m", "torque")
    twist, inertia = Parameter("M", TWIST, "N m", "torque"), Parameter("I", 1.0, "kg m2", "inertia")
    pusher = Automaton(
        name="pusher",
        title="A force that rises",
        source="test",
        states=[f, s, turned],
        flows={f: r, s: speed, turned: spin},
        outputs=[Output("push", f, "N", "force"), Output("turn", twist + 0 * turned * twist, "N m", "torque")],
    )
    pushed = Automaton(
        name="pushed",
        title="A mass",
        source="test",
        states=[v, w],
        flows={v: force / m, w: torque / inertia},
        outputs=[Output("speed", v, "m/s", "speed"), Output("spin", w, "rad/s", "speed")],
    )
    return pusher, pushed


@pytest.fixture(scope="module")
def units(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Unit]:
    folder, opened = tmp_path_factory.mktemp("bonds"), {}
    for name, declared in zip("ab", _ends(), strict=True):
        quick_export(declared, folder / f"{name}.fmu", fmi_version="3.0")
        opened[name] = Unit(Fmu.open(folder / f"{name}.fmu"))
    return opened


LINEAR = ("a.push -> b.force", "b.speed -> a.v")
TURNING = ("a.turn -> b.torque", "b.spin -> a.w")


def _shares(method: str) -> dict[str, float]:
    """Of the bonds that a method tells, by one of their ends."""
    _, _, told = method.partition("; of the energy passed, made or lost by stepping: ")
    parts = [part.split(" at ") for part in told.split(", ")] if told else []
    return {name: float(share) for share, name in parts}


@pytest.mark.parametrize("n", [5, 10, 40])
def test_the_share_is_that_of_the_closed_form(units: dict[str, Unit], n: int) -> None:
    """F = r t is expected rightly from its slope on; v = r t^2/(2 m) by the tangent at t_{k-1}, short by r h^2/(2 m) at
    the first two points, and rightly from the third on. So made: sum r t_k r h^2/(2 m) h over k = 1, 2; passed: sum of
    r t_k r t_k^2/(2 m) h."""
    system = CoupledSystem("push", units, wires(*LINEAR), solver="co-simulation", step=1.0 / n, stop_time=1.0)
    shares = _shares(couple(system).method)
    assert list(shares) == ["a.push and b.speed"]
    assert shares["a.push and b.speed"] == pytest.approx((1 + 2) / sum(k**3 for k in range(1, n + 1)), rel=0.05)


def test_what_is_expected_rightly_makes_no_energy(units: dict[str, Unit]) -> None:
    # a constant torque, a speed that is a line
    system = CoupledSystem("turn", units, wires(*TURNING), solver="co-simulation", step=0.1, stop_time=1.0)
    assert _shares(couple(system).method)["a.turn and b.spin"] < 1e-12


def test_bonds_are_told_apart_by_their_units(units: dict[str, Unit]) -> None:
    system = CoupledSystem("both", units, wires(*LINEAR, *TURNING), solver="co-simulation", step=0.1, stop_time=1.0)
    assert set(_shares(couple(system).method)) == {"a.push and b.speed", "a.turn and b.spin"}
    alone = system.changed(connections=wires(LINEAR[0], TURNING[1]))
    assert not _shares(couple(alone).method)
    # places are no powers
    assert not _shares(couple(system.changed(connections=wires(LINEAR[0]))).method)


def test_a_tighter_tolerance_makes_less_energy(units: dict[str, Unit]) -> None:
    system = CoupledSystem("push", units, wires(*LINEAR), solver="co-simulation", stop_time=1.0)
    loose, tight = (_shares(couple(system.changed(tolerance=t)).method)["a.push and b.speed"] for t in (1e-3, 1e-9))
    assert tight < 1e-2 * loose < 1e-2


def _in_threads(monkeypatch: pytest.MonkeyPatch) -> set[int]:
    """The threads in which units step from now on."""
    threads, step = set[int](), SteppedUnit.step

    def noted(unit: SteppedUnit, *arguments: Any) -> float:
        threads.add(threading.get_ident())
        return step(unit, *arguments)

    monkeypatch.setattr(SteppedUnit, "step", noted)
    return threads


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_units_in_threads_make_the_same_bits(version: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The rig with a motor, whose events stop the other unit."""
    rig = Unit(Fmu.open(built("disc_rig", contacts=["disc0"], fmi_version=version)))
    motor = Fmu.open(built("drive_motor", fmi_version=version))
    drive = Unit(motor, {"K": 2.0, "T": 0.02}, {"w": 0.41}, {"w_set": 0.41})
    joined = wires("motor.speed -> rig.w0", "motor.acceleration -> rig.w0_rate", "rig.F0 -> motor.F")
    system = CoupledSystem("rig", {"rig": rig, "motor": drive}, joined, solver="co-simulation", stop_time=2.0)
    threads = _in_threads(monkeypatch)
    inturn = couple(system.changed(tolerance=1e-5))
    assert threads == {threading.get_ident()}
    abreast = couple(system.changed(tolerance=1e-5, parallel=True))
    assert len(threads) > 1
    assert inturn.events == abreast.events and len(inturn.events) > 1
    assert (inturn.steps, inturn.evaluations) == (abreast.steps, abreast.evaluations)
    for name, values in inturn.values.items():
        assert np.array_equal(abreast[name], values), name


def test_the_setting_stands_in_a_file(tmp_path: Path) -> None:
    fmu = exported("mass", tmp_path)
    assert not masses(fmu).parallel
    text = f"parallel = true\n[units.a]\nfmu = '{fmu.path.name}'\n"
    (tmp_path / "masses.toml").write_text(text, "utf-8")
    assert read_system(tmp_path / "masses.toml").parallel
    (tmp_path / "masses.toml").write_text(text.replace("true", "2"), "utf-8")
    with pytest.raises(StickslipError, match="line 1: 'parallel' must be true or false"):
        read_system(tmp_path / "masses.toml")
