"""Branches of many states: a chain of blocks on a belt, and a cantilever with a stop by its modes.

    Burridge-Knopoff:   m x_i'' + c x_i' = kc (x_(i+1) - 2 x_i + x_(i-1)) - k_i x_i + kp a cos(omega t) + F(x_i' - v)
    cantilever:         q_i'' + 2 zeta w_i q_i' + w_i^2 q_i = phi_i(L) (a cos(omega t) - stop),  phi_i(L) = 2 (-1)^(i+1)

cos(b) cosh(b) = -1, w_i = (b_i/b_1)^2: modes of unit mass, the first of 1 rad/s. A law of friction that falls with slip
speed, as Carlson and Langer, Physical Review A 40 (1989), have it.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from mechanisms import opened
from scipy.linalg import expm
from scipy.optimize import brentq

from fmu_models import TIME, Conti, Coordinate, Friction, KelvinVoigt, Mechanism, Parameter, Stop, Strobe, branch
from fmu_models.continuation.branch import Branch
from fmu_models.continuation.problem import runs
from fmu_models.continuation.problem.node import passing_test
from fmu_models.fmu.fmu import Fmu

A, OMEGA = 0.02, 1.15
ZETA = 0.05


def burridge_knopoff(n: int) -> Mechanism:
    m, c = Parameter("m", 1.0, "kg", "block", positive=True), Parameter("c", 0.1, "N s/m", "damping")
    kc, kp = Parameter("kc", 4.0, "N/m", "coupling"), Parameter("kp", 1.0, "N/m", "springs to the plate")
    mu_s, mu_k = Parameter("mu_s", 0.4, "1", "friction at rest"), Parameter("mu_k", 0.2, "1", "at speed")
    load, p = Parameter("N", 1.0, "N", "load"), Parameter("p", 1.0, "s/m", "fall of friction")
    belt, a = Parameter("v_belt", 1.0, "m/s", "belt"), Parameter("a", 0.6, "m", "amplitude of the plate")
    omega = Parameter("omega", 1.6, "rad/s", "frequency", positive=True)
    x = [Coordinate(f"x{i}", "m", f"block {i}", velocity=f"v{i}") for i in range(n)]
    plate = [kp * (1 + sympy.Rational(i, 2 * n)) * x[i] ** 2 / 2 for i in range(n)]
    return Mechanism(
        name=f"burridge_knopoff_{n}",
        title="blocks on a belt",
        source="Carlson and Langer (1989)",
        coordinates=x,
        kinetic_energy=sum((m * q.v**2 / 2 for q in x), sympy.S.Zero),
        potential_energy=sum(plate, sum((kc * (x[i + 1] - x[i]) ** 2 / 2 for i in range(n - 1)), sympy.S.Zero)),
        dissipation=sum((c * q.v**2 / 2 for q in x), sympy.S.Zero),
        applied={q: kp * a * sympy.cos(omega * TIME) for q in x},
        contacts=[Friction(name=f"f{i}", slip=q.v - belt, law=Conti(load, mu_s, mu_k, p)) for i, q in enumerate(x)],
    )


def frequencies(n: int) -> np.ndarray:
    """Of the first modes of a cantilever, in that of the first."""
    roots = [
        brentq(lambda b: np.cos(b) + 1 / np.cosh(b), i * np.pi + 1.1, i * np.pi + 2.1, xtol=1e-15) for i in range(n)
    ]
    return (np.array(roots) / roots[0]) ** 2


def cantilever(n: int) -> Mechanism:
    names = {"a": (A, "N"), "gap": (0.2, "m"), "ks": (0.5, "N/m"), "cs": (0.02, "N s/m"), "zeta": (ZETA, "1")}
    p = {name: Parameter(name, value, unit, name) for name, (value, unit) in names.items()}
    m, k = Parameter("m", 1.0, "kg", "unit", positive=True), Parameter("k", 1.0, "N/m", "unit")
    c, omega = Parameter("c", 1.0, "N s/m", "unit"), Parameter("omega", OMEGA, "rad/s", "frequency", positive=True)
    q = [Coordinate(f"q{i}", "m", f"mode {i}", velocity=f"w{i}") for i in range(n)]
    w = [sympy.Float(value) for value in frequencies(n)]
    shapes = [sympy.Integer(2 * (-1) ** i) for i in range(n)]
    tip = sum((shape * x for shape, x in zip(shapes, q, strict=True)), sympy.S.Zero)
    return Mechanism(
        name=f"cantilever_{n}",
        title="cantilever with a stop at its tip",
        source="closed form",
        coordinates=q,
        kinetic_energy=sum((m * x.v**2 / 2 for x in q), sympy.S.Zero),
        potential_energy=sum((k * w[i] ** 2 * q[i] ** 2 / 2 for i in range(n)), sympy.S.Zero),
        dissipation=sum((c * p["zeta"] * w[i] * q[i].v ** 2 for i in range(n)), sympy.S.Zero),
        applied={x: shape * p["a"] * sympy.cos(omega * TIME) for shape, x in zip(shapes, q, strict=True)},
        contacts=[Stop(name="stop", gap=p["gap"] - tip, law=KelvinVoigt(p["ks"], p["cs"]), release="force")],
    )


def along_chain(fmu: Fmu, between: tuple[float, float], points: int) -> Branch:
    strobe = Strobe(fmu, forcing="omega", parameters={"a": 0.5, "omega": 1.6})
    return branch(strobe, "a", between, settle=True, points=points)


def test_a_chain_by_mixed_tangents_is_that_by_tangents_of_each_state(monkeypatch):
    """Ten blocks to where the first begins to stick: points, multipliers, the corner."""
    fmu = opened(burridge_knopoff(10))
    mixed = along_chain(fmu, (0.45, 0.75), 60)
    monkeypatch.setattr(runs, "LARGE", 1000)
    single = along_chain(fmu, (0.45, 0.75), 60)
    assert [(s.kind, s.contact) for s in mixed.special] == [(s.kind, s.contact) for s in single.special]
    assert mixed.special[0].kind == "grazing-sliding corner"
    assert [s.value for s in mixed.special] == pytest.approx([s.value for s in single.special], rel=1e-10)
    for value in (0.46, 0.6, 0.7):
        (one,), (other,) = mixed.at(value), single.at(value)
        assert one.state_at(0.0) == pytest.approx(other.state_at(0.0), abs=1e-11)
        assert np.abs(one.multipliers) == pytest.approx(np.abs(other.multipliers), rel=1e-10)


def over_frequency(modes: int, between: tuple[float, float]) -> Branch:
    strobe = Strobe(opened(cantilever(modes)), forcing="omega", parameters={"omega": OMEGA})
    return branch(strobe, "omega", between, settle=True)


def check_cantilever(found: Branch, modes: int) -> None:
    """Folds and grazings of the resonance; free of the stop closed forms of the grazing and of all multipliers."""
    w = frequencies(modes)
    assert sorted(special.kind for special in found.special) == ["fold", "fold", "grazing, compliant"]

    def tip(omega: float) -> float:
        return abs(4.0 * A * (1.0 / (w**2 - omega**2 + 2j * ZETA * w * omega)).sum()) - 0.2

    (grazing,) = (special for special in found.special if special.kind == "grazing, compliant")
    assert grazing.value == pytest.approx(brentq(tip, 1.1, 1.3, xtol=1e-15), rel=1e-11)
    folds = [special for special in found.special if special.kind == "fold"]
    assert all(np.abs(fold.multipliers - 1.0).min() < 1e-6 for fold in folds)
    free = next(node for node in found.nodes if not node.word)
    blocks = [expm(np.array([[0.0, 1.0], [-v * v, -2.0 * ZETA * v]]) * free.seen.length) for v in w]
    expected = np.sort(np.concatenate([np.abs(np.linalg.eigvals(block)) for block in blocks]))[::-1]
    large = expected > 1e-6
    assert np.abs(free.multipliers)[large] == pytest.approx(expected[large], rel=1e-8)


def test_folds_and_grazing_of_a_cantilever_of_three_modes():
    check_cantilever(over_frequency(3, (1.12, 1.25)), 3)


@pytest.mark.nightly
def test_folds_and_grazing_of_a_cantilever_of_forty_states():
    check_cantilever(over_frequency(20, (1.15, 1.2)), 20)


@pytest.mark.nightly
def test_fifty_blocks_to_where_the_first_begins_to_stick():
    found = along_chain(opened(burridge_knopoff(50)), (0.45, 0.75), 40)
    assert found.special[0].kind == "grazing-sliding corner"
    assert all(np.abs(node.seen.residual).max() < 1e-11 for node in found.nodes)


def test_the_pairs_of_hundreds_of_multipliers_still_have_a_sign():
    """Their product is 1e-700 by itself; a pair that leaves the circle is seen, and nothing else."""
    angles = np.linspace(0.1, 3.0, 40)
    spectrum = np.concatenate([0.7 * np.exp(1j * angles), 0.7 * np.exp(-1j * angles)]).astype(complex)
    outside = spectrum.copy()
    outside[np.abs(np.abs(np.angle(spectrum)) - angles[7]) < 1e-9] *= 1.5
    inside, past = (passing_test(multipliers, "circle") for multipliers in (spectrum, outside))
    assert inside * past < 0.0
