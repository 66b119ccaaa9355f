"""A block that friction holds, and a force that comes to what friction can give, exactly or with its rate untold.

m x'' = u - F while it slides;    u = c t from rest: x = c (t - F/c)^3/(6 m)

    on a plate with the speed V = A (1 - cos w t), oiled:    m v' = F + b (V - v) once m V' > F
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
import sympy
from quick_export import quick_export

from fmu_models import TIME, Coordinate, Coulomb, Friction, Input, Mechanism, Parameter
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.laws.coulomb_viscous import CoulombViscous
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal

SLOPE, END = 0.5, 4.0  # N/s, s; the friction is 1 N, the mass 1 kg


@pytest.fixture(scope="module", params=["2.0", "3.0"])
def block(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    x, u = Coordinate("x", "m", "place", velocity="v"), Input("u", 0.0, "N", "force")
    m, F = Parameter("m", 1.0, "kg", "mass", positive=True), Parameter("F", 1.0, "N", "friction", minimum=0.0)
    made = Mechanism(
        name="block", title="block", source="", coordinates=[x], kinetic_energy=m * x.v**2 / 2, applied={x: u},
        contacts=[Friction(name="floor", slip=x.v, law=Coulomb(N=sympy.S.One, mu=F))],
    )  # fmt: skip
    return quick_export(made, tmp_path_factory.mktemp("block") / "block.fmu", fmi_version=request.param)


def pushed(block: Path, kind: str, **how: Any) -> float:
    """Where the block is at the end of a ramp of which fmpy tells the values alone."""
    ramp = np.array([(0.0, 0.0), (END, SLOPE * END)], dtype=[("time", float), ("u", float)])
    found = fmpy.simulate_fmu(block, stop_time=END, input=ramp, output=["x"], fmi_type=kind, **how)
    return float(found["x"][-1])


@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
def test_a_force_whose_rate_is_not_told_moves_the_block_all_the_same(block: Path, kind: str):
    """By fmpy an input rises within its step or at its ends, and an event may come a step late."""
    step = 0.01  # s: the force is 1 N exactly at an end of one
    moved = pushed(block, kind, output_interval=step, **({"step_size": step} if kind == "CoSimulation" else {}))
    exact = (END - 1 / SLOPE) ** 3 * SLOPE / 6
    assert moved == pytest.approx(exact, abs=step * SLOPE * (END - 1 / SLOPE) ** 2)


@pytest.mark.parametrize("times", [[0.0, END], [0.0, 2.0, END]])
def test_a_force_that_stays_at_the_limit_holds(block: Path, times: list[float]):
    """Friction gives 1 N, and all of it is asked for: from the start, or after a ramp to there."""
    force = Signal(times, [1.0, 1.0] if len(times) == 2 else [0.0, 1.0, 1.0])
    run = simulate(Fmu.open(block), END, inputs={"u": force})
    assert np.all(run["x"] == 0.0)


def test_a_force_that_leaves_the_limit_moves_the_block_from_then_on(block: Path):
    run = simulate(Fmu.open(block), END, inputs={"u": Signal([0.0, 2.0, END], [1.0, 1.0, 2.0])})
    assert run["x"][-1] == pytest.approx((END - 2.0) ** 3 * 0.5 / 6, rel=1e-9)


@pytest.mark.parametrize("w", [1.5, 2.0, 3.0, 4.5])
def test_what_an_importer_drifts_off_does_not_hold_a_block_that_slips(tmp_path: Path, w: float):
    """The speed of a held block is the importer's to integrate, and steep friction reads its errors as slip."""
    x, m = Coordinate("x", "m", "place", velocity="v"), Parameter("m", 1.0, "kg", "mass", positive=True)
    A, F, b = 1.0, 1.0, 1000.0  # m/s, N, N s/m
    oiled = CoulombViscous(N=sympy.S.One, mu=sympy.Float(F), mu_v=sympy.Float(b))
    made = Mechanism(
        name="oiled", title="oiled", source="", coordinates=[x], kinetic_energy=m * x.v**2 / 2,
        contacts=[Friction(name="plate", slip=x.v - A * (1 - sympy.cos(w * TIME)), law=oiled)],
    )  # fmt: skip
    path = quick_export(made, tmp_path / "oiled.fmu")
    end = 0.5 * np.pi / w  # the plate is fastest to gain speed
    found = fmpy.simulate_fmu(path, stop_time=end, relative_tolerance=1e-6, output=["v"], fmi_type="ModelExchange")
    leaves = np.arcsin(F / (A * w)) / w
    # v = V - y, y' + b y = A w sin(w t) - F, y = 0 where it leaves
    forced = A * w / (b**2 + w**2) * (b * np.sin(w * np.array([end, leaves])) - w * np.cos(w * np.array([end, leaves])))
    y = forced[0] - F / b - (forced[1] - F / b) * np.exp(-b * (end - leaves))
    assert found["v"][-1] == pytest.approx(A * (1 - np.cos(w * end)) - y, abs=2e-5)
