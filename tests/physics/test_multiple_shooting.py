"""Periodic motions in several segments: multipliers by closed forms and sixty digits, branches by one segment.

    x'' + c x' - k x = a cos(omega t),    stops at |x| = gap: stiffness K, damping C

Free of the stops it is -A cos(omega t + phi), unstable: multipliers exp(lambda T), lambda = -c/2 +- sqrt(c^2/4 + k).
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
import sympy
from lazy_fmu import LazyFmu
from mechanisms import opened

from fmu_models import TIME, Coordinate, KelvinVoigt, Mechanism, Parameter, Stop, Strobe, branch
from fmu_models.continuation.branch import Branch
from fmu_models.continuation.problem import flow
from fmu_models.continuation.problem.node import Node
from fmu_models.fmu.fmu import Fmu
from fmu_models.sections.stability import product_eigenvalues

K, C, GAP, W = 4.0, 0.3, 1.0, 0.2
SUPPORT = LazyFmu("discontinuous_support")


def unstable(c: float) -> Mechanism:
    x = Coordinate("x", "m", "place", velocity="v")
    k, damping = Parameter("k", 1.0, "N/m", "negative stiffness"), Parameter("c", c, "N s/m", "damping")
    m, omega = (
        Parameter("m", 1.0, "kg", "mass", positive=True),
        Parameter("omega", W, "rad/s", "frequency", positive=True),
    )
    a, gap = Parameter("a", 0.5, "N", "amplitude"), Parameter("gap", GAP, "m", "gap")
    law = KelvinVoigt(Parameter("ks", K, "N/m", "stiffness"), Parameter("cs", C, "N s/m", "damping"))
    return Mechanism(
        name="unstable_between_stops",
        title="unstable between stops",
        source="closed form",
        coordinates=[x],
        kinetic_energy=m * x.v**2 / 2,
        potential_energy=-k * x**2 / 2,
        dissipation=damping * x.v**2 / 2,
        applied={x: a * sympy.cos(omega * TIME)},
        contacts=[
            Stop(name="above", gap=gap - x, law=law, release="force"),
            Stop(name="below", gap=gap + x, law=law, release="force"),
        ],
    )


def at_rest_within(omega: float, c: float, a: float = 0.5) -> list[float]:
    """State at phase 0 of the motion that is free of the stops."""
    b = a / (1j * c * omega - omega**2 - 1.0)
    return [b.real, (1j * omega * b).real]


@pytest.fixture(scope="module")
def fmu() -> Fmu:
    return opened(unstable(0.1))


def cuts(node: Node) -> tuple[float, ...]:
    """Where its segments begin beside the first."""
    assert isinstance(node.problem, flow.FlowProblem)
    return node.problem.cuts


def product(factors: np.ndarray):
    """Eigenvalues of the product, in sixty digits, largest first."""
    with mpmath.workdps(60):
        total = mpmath.eye(factors.shape[1])
        for factor in factors:
            total = mpmath.matrix(factor.tolist()) * total
        values = mpmath.eig(total, left=False, right=False)
    return sorted(values, key=lambda value: -abs(value))


def test_eigenvalues_of_a_product_of_any_size_are_those_of_sixty_digits():
    """Sizes from 1e20 to 1e-20 in eight factors, a pair and a negative one among them; rounding of the product would
    leave none but the first."""
    rng = np.random.default_rng(3)
    basis = np.linalg.qr(rng.normal(size=(5, 5)))[0]
    core = np.diag([300.0, 0.9, 0.9, -0.4, 3e-3])
    core[1:3, 1:3] = [[0.9, -0.5], [0.5, 0.9]]
    factors = np.array([basis @ core @ basis.T @ (np.eye(5) + 0.02 * rng.normal(size=(5, 5))) for _ in range(8)])
    sizes = np.abs(product_eigenvalues(factors))
    expected = [float(abs(value)) for value in product(factors)]
    assert expected[0] / expected[-1] > 1e38
    assert sizes == pytest.approx(expected, rel=1e-11)


def test_eigenvalues_of_a_product_may_be_zero():
    """A factor without rank, as of a stick."""
    factors = np.array([np.diag([1e5, 2.0, 0.0]), np.array([[1.0, 2.0, 1.0], [0.0, 3.0, 1.0], [0.0, 0.0, 1.0]])])
    assert product_eigenvalues(factors) == pytest.approx([1e5, 6.0, 0.0], rel=1e-12)


@pytest.fixture(scope="module")
def over_frequency(fmu: Fmu) -> Branch:
    strobe = Strobe(fmu, forcing="omega", parameters={"omega": 1.0, "a": 0.5})
    return branch(strobe, "omega", (0.1, 1.2), start=at_rest_within(1.0, 0.1))


def test_multipliers_from_1e26_to_1e_minus_29_are_those_of_the_closed_form(over_frequency):
    """Slower forcing: tangents grow by e^62 in a period at last; one segment ends at 4e7."""
    assert [kind for kind, _ in over_frequency.ends] == ["range", "range"]
    rates = -0.05 + np.sqrt(0.0025 + 1.0) * np.array([1.0, -1.0])
    for node in over_frequency.nodes:
        expected = np.exp(rates * node.seen.length)
        assert node.multipliers[0] == pytest.approx(expected[0], rel=1e-12)
        if cuts(node):
            assert node.multipliers[1] == pytest.approx(expected[1], rel=1e-6)
        assert node.state_at(0.0) == pytest.approx(at_rest_within(node.value, 0.1), abs=1e-13)
    assert over_frequency.nodes[0].multipliers[0].real > 1e25
    assert {len(cuts(node)) for node in over_frequency.nodes} >= {0, 1, 3}


@pytest.fixture(scope="module")
def over_amplitude(fmu: Fmu) -> Branch:
    strobe = Strobe(fmu, forcing="omega", parameters={"omega": W, "a": 0.9})
    return branch(strobe, "a", (0.8, 1.1), start=at_rest_within(W, 0.1, 0.9), points=120)


def test_grazing_of_a_motion_with_a_multiplier_of_1e13(over_amplitude):
    """It touches both stops at a = gap sqrt((1 + omega^2)^2 + (c omega)^2), with no digit lost."""
    first = over_amplitude.special[0]
    assert first.kind == "grazing, compliant"
    assert first.value == pytest.approx(GAP * np.hypot(1.0 + W**2, 0.1 * W), rel=1e-13)
    assert np.abs(first.multipliers[0]) > 1e12


def test_multipliers_through_stops_are_those_of_products_of_exponentials(over_amplitude):
    """Piecewise linear: exp(A t) of the flights and contacts, the jump of the tangent at each entry; Liouville."""
    nodes = [node for node in over_amplitude.nodes if len(node.word) >= 2 and cuts(node)]
    assert nodes
    for node in nodes[:: max(1, len(nodes) // 5)]:
        with mpmath.workdps(60):
            free = mpmath.matrix([[0, 1], [1, -mpmath.mpf(0.1)]])
            held = mpmath.matrix([[0, 1], [1 - K, -mpmath.mpf(0.1) - mpmath.mpf(C)]])
            total, time, within, closed = mpmath.eye(2), mpmath.mpf(0), False, mpmath.mpf(0)
            for event in [*node.seen.events, None]:
                end = mpmath.mpf(node.seen.length if event is None else event.time)
                total = mpmath.expm((held if within else free) * (end - time)) * total
                closed += (end - time) * within
                time = end
                if event is not None and event.after == 3:
                    total = mpmath.matrix([[1, 0], [-mpmath.mpf(C), 1]]) * total
                within = event is not None and event.after == 3
            expected = sorted(mpmath.eig(total, left=False, right=False), key=lambda value: -abs(value))
            volume = mpmath.exp(-mpmath.mpf(0.1) * time - mpmath.mpf(C) * closed)
        for multiplier, value in zip(node.multipliers, expected, strict=True):
            assert abs(multiplier) == pytest.approx(float(abs(value)), rel=1e-7)
        assert float(np.prod(node.multipliers).real) == pytest.approx(float(volume), rel=1e-7)


def test_a_branch_in_segments_has_the_points_of_one_segment(monkeypatch):
    """Folds, grazings, states and multipliers of the support."""

    def followed() -> Branch:
        strobe = Strobe(SUPPORT, forcing="omega", parameters={"ks": 10.0, "omega": 0.92})
        return branch(strobe, "omega", (0.9, 1.2), start=[2.0, 0.0], settle=True)

    whole = followed()
    monkeypatch.setattr(flow, "HUGE", 0.0)
    monkeypatch.setattr(flow, "GROWTH", 1.8)
    divided = followed()
    assert all(cuts(node) == () for node in whole.nodes)
    assert sum(bool(cuts(node)) for node in divided.nodes) > len(divided.nodes) / 3
    assert [special.kind for special in divided.special] == [special.kind for special in whole.special]
    assert [s.value for s in divided.special] == pytest.approx([s.value for s in whole.special], rel=1e-11)
    for value in (0.95, 1.0, 1.1):
        pairs = list(zip(whole.at(value), divided.at(value), strict=True))
        assert pairs
        for one, many in pairs:
            assert many.state_at(0.0) == pytest.approx(one.state_at(0.0), abs=1e-11)
            assert np.abs(many.multipliers) == pytest.approx(np.abs(one.multipliers), rel=1e-10)
