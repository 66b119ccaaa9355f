"""Bouc and Wen's law with half-integer n, whose series begin anew at z = 0, against DOP853 split there."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from fmpy import simulate_fmu
from quick_export import quick_export
from scipy.integrate import solve_ivp

from fmu_models import TIME, BoucWen, Coordinate, Fmu, Hysteresis, KeptRun, Mechanism, Parameter, SensitiveRun

END = 15.0
UNITS = {"m": "kg", "k": "N/m", "a": "N", "w": "rad/s", "stiffness": "N/m"}


def mass_on_law(n: float) -> Mechanism:
    """A driven mass on a spring and the law."""
    values = {"m": 1.0, "k": 1.0, "a": 2.0, "w": 1.3, "stiffness": 3.0, "beta": 1.1, "gamma": 0.4}
    p = {name: Parameter(name, value, UNITS.get(name, f"1/m{n}"), name) for name, value in values.items()}
    x = Coordinate("x", "m", "displacement", velocity="v")
    law = BoucWen(k=p["stiffness"], beta=p["beta"], gamma=p["gamma"], n=n)
    return Mechanism(
        name=f"half_{int(2 * n)}",
        title="mass on a smooth law",
        source="test",
        coordinates=[x],
        kinetic_energy=p["m"] * x.v**2 / 2,
        potential_energy=p["k"] * x**2 / 2,
        applied={x: p["a"] * sympy.sin(p["w"] * TIME)},
        contacts=[Hysteresis(name="h", way=x, law=law)],
    )


def split(n: float, p: dict[str, float], v: float) -> tuple[list[float], int]:
    """x, v, z at the end, and how often v or z passed zero; from v > 0, or from rest, which the drive ends so."""
    t, y, signs, passed = 0.0, np.array([0.0, v, 0.0]), np.array([1.0, 1.0]), 0

    def rates(t: float, y: np.ndarray, sv: float, sz: float) -> list[float]:
        size = max(sz * y[2], 0.0) ** n
        force = p["a"] * np.sin(p["w"] * t) - p["k"] * y[0] - p["stiffness"] * y[2]
        return [y[1], force / p["m"], y[1] * (1 - size * (p["gamma"] + p["beta"] * sv * sz))]

    while True:
        events: list = [lambda t, y, i=i, s=s: s * y[i] if t > 0 else 1.0 for i, s in enumerate(signs, 1)]
        for event in events:
            event.terminal, event.direction = True, -1
        run = solve_ivp(
            lambda t, y, s=tuple(signs): rates(t, y, *s), (t, END), y, "DOP853", events=events, rtol=1e-13, atol=1e-15,
            max_step=0.02,
        )  # fmt: skip
        t, y = run.t[-1], run.y[:, -1].copy()
        if run.status != 1:
            return y.tolist(), passed
        for i, hits in enumerate(run.t_events):
            if len(hits):
                signs[i], y[1 + i], passed = -signs[i], 0.0, passed + 1


@pytest.fixture(scope="module", params=[1.5, 2.5])
def case(request, tmp_path_factory) -> tuple[float, object]:
    """n, and a file of the model."""
    name = f"half_{int(2 * request.param)}.fmu"
    return request.param, quick_export(mass_on_law(request.param), tmp_path_factory.mktemp("half") / name)


@pytest.mark.nightly_for("12")
@pytest.mark.parametrize("count", [2, 12])
def test_half_integer_powers_move_as_split_integration_says(case, count: int) -> None:
    """1e-10 of states of order 1, from a speed and from rest, where z begins like the third power of time."""
    n, file = case
    run, rng = KeptRun(Fmu.open(file)), np.random.default_rng(count)
    for i in range(count):
        p = {"m": rng.uniform(0.5, 2), "k": rng.uniform(0.2, 2), "a": rng.uniform(1, 4), "w": rng.uniform(0.5, 2)}
        p |= {"stiffness": rng.uniform(1, 5), "beta": rng.uniform(0.5, 2), "gamma": rng.uniform(-0.4, 1)}
        v = 0.0 if i % 2 else rng.uniform(0.1, 1.5)
        expected, passed = split(n, p, v)
        end = run(END, parameters=p, start={"v": v})
        assert [end[name][-1] for name in ("x", "v", "h_z")] == pytest.approx(expected, abs=1e-10)
        assert passed > 5


def test_derivatives_pass_through_zero(case) -> None:
    """Against central differences of whole runs, whose steps leave 1e-7."""
    _, file = case
    plain = KeptRun(Fmu.open(file))
    by, step = ["beta", "gamma", "stiffness", "a", "v"], 1e-5
    given = {"beta": 1.1, "gamma": 0.3, "stiffness": 2.5, "a": 2.2, "v": 0.4}
    with SensitiveRun(Fmu.open(file), by=by, recorded=["x", "h_z"]) as kept:
        parameters = {name: value for name, value in given.items() if name != "v"}
        derivative = kept.run([END], parameters=parameters, start={"v": given["v"]}).derivative[0]
    for column, name in enumerate(by):
        near = []
        for sign in (1, -1):
            moved = given | {name: given[name] + sign * step}
            end = plain(END, start={"v": moved.pop("v")}, parameters=moved)
            near.append(np.array([end["x"][-1], end["h_z"][-1]]))
        assert derivative[:, column] == pytest.approx((near[0] - near[1]) / (2 * step), abs=5e-7, rel=1e-6)
    assert np.abs(derivative).max() > 0.1


@pytest.mark.nightly
def test_importers_pass_through_zero(case) -> None:
    """Model Exchange by CVode: its tolerance."""
    n, file = case
    p = {"m": 1.0, "k": 1.0, "a": 2.0, "w": 1.3, "stiffness": 3.0, "beta": 1.1, "gamma": 0.4}
    run = simulate_fmu(
        file, stop_time=END, start_values={**p, "v": 0.5}, output=["x", "v", "h_z"], fmi_type="ModelExchange",
        relative_tolerance=1e-9,
    )  # fmt: skip
    assert [run[name][-1] for name in ("x", "v", "h_z")] == pytest.approx(split(n, p, 0.5)[0], abs=1e-6)
