"""Normal force and temperature as inputs of a contact: a block on a belt against closed forms, and as FMUs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from closed_form import root
from fmpy import simulate_fmu

from fmu_models import export
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.friction import Friction
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.laws.lugre import LuGre
from fmu_models.language.laws.warmed import Warmed
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Input, Parameter
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import SensitiveRun
from fmu_models.simulation.signal import Signal

M, K, MU, BELT, A, REF = 1.25, 60.0, 0.5, 0.1, 0.01, 293.15
LOADS, WARMTHS = (4.0, 0.8), (REF - 5, 3.0)  # N and N/s, K and K/s: at the start and per second
END = 1.05  # s, of the first slip before it sticks again


def declared() -> Mechanism:
    m, k = Parameter("m", M, "kg", "mass", positive=True), Parameter("k", K, "N/m", "stiffness", minimum=0.0)
    mu, a, ref = Parameter("mu", MU, "1", ""), Parameter("a", A, "1/K", ""), Parameter("T_ref", REF, "K", "")
    N, T = Input("N", LOADS[0], "N", "normal force"), Input("T", REF, "K", "temperature")
    x = Coordinate("x", "m", "displacement", velocity="v")
    law = Warmed(Coulomb(N, mu), T, a, ref)
    return Mechanism(
        name="warmed_belt",
        title="Block on a belt that grows warm under a load that grows",
        source="test",
        coordinates=[x],
        kinetic_energy=m * x.v**2 / 2,
        potential_energy=k * x**2 / 2,
        contacts=[Friction(name="belt", slip=x.v - BELT, law=law)],
    )


def held(t: float, a: float = A) -> float:
    """What the belt carries at a time, N."""
    return MU * (LOADS[0] + LOADS[1] * t) * (1 + a * (WARMTHS[0] + WARMTHS[1] * t - REF))


def exact(t: np.ndarray, a: float = A) -> tuple[float, np.ndarray]:
    """When the block lets go of the belt, and its place after that: m x'' + k x is a parabola of the time."""
    let_go = root(lambda s: K * BELT * s - held(s, a), 0.1, 2.0)
    c = np.polynomial.Polynomial.fit([0, 1, 2], [held(s, a) for s in (0.0, 1.0, 2.0)], 2).convert()
    parabola = c / K - M * c.deriv(2) / K**2
    w = np.sqrt(K / M)
    cosine, sine = BELT * let_go - parabola(let_go), (BELT - parabola.deriv()(let_go)) / w
    since = w * (t - let_go)
    return let_go, parabola(t) + cosine * np.cos(since) + sine * np.sin(since)


TIMES = np.array([0.0, 10.0])
DRIVEN: dict[str, Any] = {
    "N": Signal(TIMES, LOADS[0] + LOADS[1] * TIMES),
    "T": Signal(TIMES, WARMTHS[0] + WARMTHS[1] * TIMES),
}
STUCK = {"x": 0.0, "v": BELT}


def test_stick_ends_and_slip_goes_as_load_and_warmth_have_it() -> None:
    let_go, _ = exact(np.zeros(1))
    times = let_go + np.linspace(0.01, 0.5, 40)
    run = simulate(Fmu.open(built(declared())), 2.0, start=STUCK, inputs=DRIVEN, output_times=times)
    assert run.events[0].time == pytest.approx(let_go, abs=1e-11)
    assert np.all(run["belt_state"] != 0)
    assert run["x"] == pytest.approx(exact(times)[1], abs=1e-11)
    # without the warmth it would let go elsewhere
    assert abs(let_go - exact(np.zeros(1), 0.0)[0]) > 0.01


def test_derivatives_by_the_coefficient_are_those_of_the_closed_form() -> None:
    let_go, _ = exact(np.zeros(1))
    times = let_go + np.linspace(0.05, 0.5, 10)
    with SensitiveRun(Fmu.open(built(declared())), by=["a"]) as runs:
        run = runs.run(times, start=STUCK, inputs=DRIVEN)
    step = 1e-5
    slope = (exact(times, A + step)[1] - exact(times, A - step)[1]) / (2 * step)
    assert run.of("x")[:, 0] == pytest.approx(slope, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_an_exported_fmu_takes_both_as_inputs(tmp_path: Path, version: str) -> None:
    path = export(declared(), tmp_path / "belt.fmu", fmi_version=version)
    let_go, _ = exact(np.zeros(1))
    signals = np.array(
        [(t, LOADS[0] + LOADS[1] * t, WARMTHS[0] + WARMTHS[1] * t, LOADS[1], WARMTHS[1]) for t in (0.0, 3.0)],
        dtype=[(name, float) for name in ("time", "N", "T", "N_rate", "T_rate")],
    )
    values = {"x": 0.0, "v": BELT}
    result = simulate_fmu(
        path,
        fmi_type="ModelExchange",
        stop_time=let_go + 0.4,
        start_values=values,
        input=signals,
        output=["x"],
        output_interval=0.01,
        relative_tolerance=1e-9,
    )
    after = result["time"] > let_go
    assert np.count_nonzero(after) > 30
    assert result["x"][after] == pytest.approx(exact(result["time"][after])[1], abs=1e-5)  # of fmpy's integrator


def test_bristles_within_are_scaled_too() -> None:
    """In steady slip the force is that of the law within times the factor; of bristles as of dry friction."""
    base = declared()
    (contact,) = base.contacts
    assert isinstance(contact, Friction) and isinstance(contact.law, Warmed)
    law = contact.law
    bristles = LuGre(law.law, Parameter("sigma0", 2e4, "N/m", ""), Parameter("sigma1", 100.0, "N s/m", ""))  # type: ignore[arg-type]
    soft = replace(base, contacts=[replace(contact, law=replace(law, law=bristles))])
    assert not soft.contacts[0].law.sticks and law.sticks  # type: ignore[attr-defined]
    run = simulate(
        Fmu.open(built(soft)),
        0.3,
        start={"x": 0.0, "v": 0.5},
        inputs={"N": 4.0, "T": REF + 20},
        output_times=[0.05, 0.1],
    )
    slip = run["v"] - BELT
    assert np.all(slip > 0.05)
    force = M * run["der(v)"] + K * run["x"]
    assert force == pytest.approx(-MU * 4.0 * (1 + 20 * A), rel=1e-3)


def test_a_model_takes_the_law_by_name_around_its_own() -> None:
    """A contact's own law with an input T, so that a load and a warmth of a share each are one and the same."""
    fmu = Fmu.open(built("block_on_belt", laws={"belt": "warmed"}))
    given: dict[str, Any] = {"start": STUCK, "output_times": np.linspace(0, 5, 200)}
    warm = simulate(fmu, 5.0, parameters={"a_T": 0.01, "N": 5.0}, inputs={"v_belt": 0.1, "T": REF + 20}, **given)
    loaded = simulate(Fmu.open(built("block_on_belt")), 5.0, parameters={"N": 6.0}, inputs={"v_belt": 0.1}, **given)
    assert np.count_nonzero(loaded["belt_state"] == 0) > 20
    assert warm["x"] == pytest.approx(loaded["x"], abs=1e-10)
