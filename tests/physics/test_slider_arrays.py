"""Many sliders on one way, which the engine follows as one array: against operators and event-split integration."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy
from emulated_loop import of_sliders
from sliders import MassOnSliders, N, a, driven_mass, k, m, w, x

from fmu_models import (
    TIME,
    Coordinate,
    Coulomb,
    Friction,
    Hysteresis,
    Input,
    Iwan4,
    KeptRun,
    LuGre,
    MaxwellSlip,
    Mechanism,
    Output,
    Parameter,
    SensitiveRun,
    Signal,
    load,
    simulate,
)
from fmu_models.codegen.c_source import sources
from fmu_models.explorer.module import wasm
from fmu_models.lowering.fold import fold
from fmu_models.lowering.lower import lower

mu = Parameter("mu", 0.1, "1", "friction", minimum=0)
F_S = Parameter("F_S", 1.5, "N", "sliding force", positive=True)
K_T = Parameter("K_T", 3.0, "N/m", "stiffness", positive=True)
L = Parameter("L", 1.0, "m", "unit of length")


def mass_on_joint(n: int, *beside: object, name: str = "mass_on_joint") -> Mechanism:
    """A driven mass on a joint of n sliders."""
    law = Iwan4(F_S=F_S, K_T=K_T, chi=-0.5, beta=0.3, sliders=n)
    return driven_mass(f"{name}_{n}", Hysteresis(name="h", way=x, law=law), *beside)


REST = Coordinate("rest", "m", "a body", velocity="rest_speed")


def on_ways(name: str, *held: Hysteresis, beside: Friction | None = None) -> Mechanism:
    """Forces along ways that inputs prescribe, and a body that nothing moves."""
    return Mechanism(
        name=name,
        title="laws along ways",
        source="test",
        coordinates=[REST],
        kinetic_energy=m * REST.v**2 / 2,
        contacts=[*held, *([beside] if beside else [])],
        outputs=[Output(f"F_{contact.name}", contact.force, "N", "force") for contact in held],
    )


def drawn_way(seed: int) -> np.ndarray:
    """A random way, m."""
    return np.concatenate([[0.0], np.cumsum(np.random.default_rng(seed).uniform(-0.4, 0.4, 200))])


U, W = Input("ua", 0.0, "m", "way"), Input("ub", 0.0, "m", "other way")


def test_arrays_on_two_ways_beside_bristles_keep_their_own_sliders() -> None:
    """Sums of stop operators, sample by sample, one load by an input: rounding. Some bounds and stiffnesses agree."""
    first = [2.0, 1.0, 1.0, 0.5], [0.1, 0.1, 0.5, 0.9]
    other = [1.0, -0.4, 3.0], [0.2, 0.7, 0.05]
    bristles = Friction(
        name="f", slip=REST.v,
        law=LuGre(steady=Coulomb(N=N, mu=mu), sigma0=sympy.Float(3.0), sigma1=sympy.S.Zero),
    )  # fmt: skip
    contacts = [
        Hysteresis(name=name, way=way, law=MaxwellSlip(k=law[0], D=law[1]), load=1 + (W / L) ** 2 if name == "b" else 1)
        for name, way, law in (("a", U, first), ("b", W - U / 2, other))
    ]
    one, two = drawn_way(3), drawn_way(4)
    times = np.arange(len(one), dtype=float)
    run = simulate(
        on_ways("two_arrays", *contacts, beside=bristles), times[-1],
        inputs={"ua": Signal(times, one), "ub": Signal(times, two)}, output_times=times,
    )  # fmt: skip
    assert run["F_a"] == pytest.approx(of_sliders(one, *first), abs=1e-12)
    assert run["F_b"] == pytest.approx((1 + two**2) * of_sliders(two - one / 2, *other), abs=1e-11)


@pytest.mark.nightly
def test_ninety_nine_sliders_follow_a_way() -> None:
    """The force and each elongation, of sliders that yield one by one: rounding."""
    law = Iwan4(F_S=2.0, K_T=5.0, chi=-0.5, beta=0.4, sliders=99)
    stiffness, bound = (np.array([float(e[i]) for e in law.elements]) for i in (0, 1))
    way = drawn_way(5)
    times = np.arange(len(way), dtype=float)
    run = simulate(
        on_ways("joint_99", Hysteresis(name="h", way=U, law=law)), times[-1], inputs={"ua": Signal(times, way)},
        output_times=times,
    )  # fmt: skip
    assert run["F_h"] == pytest.approx(of_sliders(way, stiffness.tolist(), bound.tolist()), abs=1e-11)
    for i in (0, 40, 98):
        assert run[f"h_z{i + 1}"] == pytest.approx(of_sliders(way, [1.0], [bound[i]]), abs=1e-12)


def test_a_spring_beyond_its_bound_starts_at_it() -> None:
    """On the side to which the way goes it yields, on the other it moves at once."""
    law = MaxwellSlip(k=[1.0, 1.0, 1.0], D=[0.2, 0.3, 0.4])
    still = on_ways("beyond_three", Hysteresis(name="h", way=U, law=law))
    run = simulate(
        still, 1.0, start={"h_z1": 0.5, "h_z2": -0.9}, inputs={"ua": Signal((0.0, 1.0), (0.0, 0.1))},
        output_times=[0.0, 1.0],
    )  # fmt: skip
    assert [run[f"h_z{i}"].tolist() for i in (1, 2)] == [pytest.approx([0.2, 0.2]), pytest.approx([-0.3, -0.2])]


def test_derivatives_of_many_sliders_are_those_of_differences() -> None:
    """By parameters of the law, which moves bounds and stiffnesses, and by a spring's start: 1e-7, as their steps."""
    friction = Friction(name="f", slip=x.v, law=Coulomb(N=N, mu=mu))
    model, by = load(mass_on_joint(12, friction, name="rubbed_joint")), ["F_S", "K_T", "mu", "a", "v", "h_z7"]
    given = {"F_S": 1.2, "K_T": 3.3, "mu": 0.08, "a": 2.2, "v": 0.7, "h_z7": 0.01}
    recorded = ["x", "h_force", "h_z3", "h_z9"]

    def split(values: dict[str, float]) -> dict[str, Any]:
        return {
            "parameters": {n: v for n, v in values.items() if n not in ("v", "h_z7")},
            "start": {n: v for n, v in values.items() if n in ("v", "h_z7")},
        }

    with SensitiveRun(model, by=by, recorded=recorded) as kept:
        run = kept.run([15.0], **split(given))
    plain, step = KeptRun(model), 1e-6
    for column, name in enumerate(by):
        near = [plain(15.0, **split(given | {name: given[name] + s * step})) for s in (1, -1)]
        differences = [(near[0][n][-1] - near[1][n][-1]) / (2 * step) for n in recorded]
        assert run.derivative[0, :, column] == pytest.approx(differences, abs=5e-7, rel=1e-6)
    assert np.abs(run.derivative).max() > 0.1


def test_sliders_that_yield_together_keep_derivatives_of_their_own() -> None:
    """F = 2 D_1 + 3 D_2 + 5 z_3 beyond bounds that are equal, whoever yields first for a neighbour."""
    bounds = [Parameter(f"D{i}", value, "m", "bound", positive=True) for i, value in ((1, 0.25), (2, 0.25), (3, 2.0))]
    held = Hysteresis(name="h", way=x, law=MaxwellSlip(k=[2.0, 3.0, 5.0], D=bounds))
    declared = Mechanism(
        name="together",
        title="three sliders",
        source="test",
        coordinates=[x],
        kinetic_energy=m * x.v**2 / 2,
        contacts=[held],
    )
    with SensitiveRun(load(declared), by=["D1", "D2", "v"], recorded=["h_force", "x"]) as kept:
        run = kept.run([1e-4], parameters={"m": 1e9}, start={"v": 1e4})
    assert run.derivative[0, 0] == pytest.approx([2.0, 3.0, 5e-4], abs=1e-6)


def test_code_of_many_sliders_is_that_of_few() -> None:
    """What steps and their derivatives run through does not grow with them; tables of constants and states do."""
    few, many = (sources(lower(mass_on_joint(n)))["model_variation.c"] for n in (5, 40))
    assert many.count("\n") == few.count("\n")
    assert few.count("elements_variation(d, j, l, 1, k);") == 1


def test_values_that_are_fixed_fold_into_the_sliders() -> None:
    """A system whose law has numbers in place of parameters moves as with them."""
    declared = lower(mass_on_joint(6))
    small = fold(declared, fixed={"F_S": 1.1, "K_T": 2.5}, values={}, start={}, outputs=[])
    bounds = [float(e.bound) for c in small.contacts for e in c.elements]
    assert bounds == pytest.approx([float(D) for _, D in Iwan4(1.1, 2.5, -0.5, 0.3, 6).elements])


@pytest.mark.nightly
def test_a_page_of_many_sliders_is_built() -> None:
    """As WebAssembly, from the same C."""
    assert wasm(load(mass_on_joint(10)))[:4] == b"\0asm"


@pytest.mark.nightly
def test_a_hundred_motions_beside_stick_slip_are_those_of_event_split_integration() -> None:
    """1e-10 of states of order 1, from drawn parameters of ten sliders and friction."""
    n, rng = 10, np.random.default_rng(20)
    stiffness = [Parameter(f"k{i}", 3 / n, "N/m", "spring", positive=True) for i in range(n)]
    bound = [Parameter(f"D{i}", 0.1 * (i + 1), "m", "bound", positive=True) for i in range(n)]
    declared = Mechanism(
        name="ten_and_friction",
        title="mass on sliders",
        source="test",
        coordinates=[x],
        kinetic_energy=m * x.v**2 / 2,
        potential_energy=k * x**2 / 2,
        applied={x: a * sympy.sin(w * TIME)},
        contacts=[
            Hysteresis(name="h", way=x, law=MaxwellSlip(k=stiffness, D=bound)),
            Friction(name="f", slip=x.v, law=Coulomb(N=N, mu=mu)),
        ],
    )
    run = KeptRun(load(declared))
    for _ in range(100):
        body = {"m": rng.uniform(0.5, 2), "k": rng.uniform(0.2, 2), "a": rng.uniform(1, 6), "w": rng.uniform(0.3, 3)}
        springs, rooms, rubs = rng.uniform(0.1, 2, n) * 3 / n, rng.uniform(0.02, 1, n), rng.uniform(0.05, 0.5)
        other = MassOnSliders(body["m"], body["k"], springs, rooms, rubs, body["a"], body["w"])
        values = {f"k{i}": v for i, v in enumerate(springs)} | {f"D{i}": v for i, v in enumerate(rooms)}
        start = {"x": rng.uniform(-0.01, 0.01), "v": rng.uniform(-2, 2)}
        expected, changes = other.run(20.0, start["x"], start["v"])
        end = run(20.0, parameters={**body, **values, "mu": rubs}, start=start)
        assert [end[name][-1] for name in ("x", "v", *(f"h_z{i + 1}" for i in range(n)))] == pytest.approx(
            expected.tolist(), abs=1e-10
        )
        assert changes > 5
