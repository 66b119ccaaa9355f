"""Structures given by matrices: a clamped beam of finite elements against Bernoulli's beam and independent code."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse
import sympy
from scipy.integrate import solve_ivp
from scipy.linalg import svd

from fmu_models import Coulomb, Friction, KelvinVoigt, Mechanism, Parameter, Stop, load, reduced, simulate
from fmu_models.base.errors import StickslipError
from fmu_models.codegen.inertia import envelope
from fmu_models.lowering.lower import lower

EI, RHO_A = 2.0, 3.0  # N m2 and kg/m of a beam of 1 m
CLAMPED = np.array([1.875104068711961, 4.694091132974175, 7.854757438237613])  # cos(x) cosh(x) = -1


def beam(n: int) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Mass and stiffness of n cubic elements, clamped at one end; deflections w and slopes t."""
    h = 1.0 / n
    K, M = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros((2 * n + 2, 2 * n + 2))
    k = [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2]]
    m = [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2]]
    signs, turned = np.diag([1, -1, 1, -1]), [2, 3, 0, 1]
    for A, rows, factor in ((K, k, EI / h**3), (M, m, RHO_A * h / 420)):
        upper = np.array(rows)
        element = np.vstack([upper, (signs @ upper.T).T[:, turned] * [[1], [-1]]]) * factor
        for e in range(n):
            A[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += element
    return M[2:, 2:], K[2:, 2:], [f"{letter}{i}" for i in range(1, n + 1) for letter in "wt"]


def followed(r: Any, x: np.ndarray, begin: float, end: float, slip: float, inside: bool) -> np.ndarray:
    """The reduced beam without its friction's and stop's switching, by solving for accelerations."""
    n, inverse = len(r.names), np.linalg.inv(r.M)

    def rates(_: float, state: np.ndarray) -> np.ndarray:
        force = np.zeros(n)
        force[:2] = -0.1 * slip, 1.0 - (500.0 * (state[1] - 0.02) if inside else 0.0)
        return np.concatenate([state[n:], inverse @ (force - r.K @ state[:n] - r.C @ state[n:])])

    return solve_ivp(rates, (begin, end), x, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]


def test_elements_are_those_of_the_textbook() -> None:
    M, K, _ = beam(1)
    np.testing.assert_allclose(K, EI * np.array([[12, -6], [-6, 4]]))
    np.testing.assert_allclose(M, RHO_A / 420 * np.array([[156, -22], [-22, 4]]))


@pytest.mark.parametrize(("elements", "rtol"), [(40, 2e-6), (260, 2e-6)])
def test_modes_are_those_of_the_beam(elements: int, rtol: float) -> None:
    """Dense, and sparse beyond some hundred degrees of freedom."""
    M, K, names = beam(elements)
    modes = reduced(scipy.sparse.csr_array(M), None, K, modes=3, names=names)
    np.testing.assert_allclose(modes.omega, CLAMPED**2 * np.sqrt(EI / RHO_A), rtol=rtol)
    np.testing.assert_allclose(modes.basis.T @ M @ modes.basis, np.eye(3), atol=1e-9)
    assert modes.left_out == pytest.approx(10.995540734875467**2 * np.sqrt(EI / RHO_A), rel=1e-5)


def test_statics_of_kept_degrees_is_exact() -> None:
    """A force at the tip bends it by F L^3/(3 EI), whatever modes there are."""
    M, K, names = beam(20)
    for modes in (0, 4):
        r = reduced(M, None, K, modes=modes, keep=["w20"], names=names, damping=0.01)
        assert r.names == ("w20", *(f"mode{k + 1}" for k in range(modes)))
        assert np.linalg.inv(r.K)[0, 0] == pytest.approx(1 / (3 * EI), rel=1e-9)
    assert np.diag(r.C)[1:] == pytest.approx(0.02 * r.omega)
    first = np.sqrt(np.min(np.linalg.eigvals(np.linalg.solve(r.M, r.K)).real))
    assert first == pytest.approx(CLAMPED[0] ** 2 * np.sqrt(EI / RHO_A), rel=1e-4)


def test_a_tip_strikes_a_stop_and_a_ring_rubs_as_independent_code_has_it() -> None:
    """Two kept degrees and four modes: friction at the middle, a stop at the tip that a force drives it into."""
    M, K, names = beam(20)
    r = reduced(M, None, K, modes=4, keep=["w10", "w20"], names=names, damping=0.02)
    gap, stiff = Parameter("d", 0.02, "m", "gap"), Parameter("k_stop", 500.0, "N/m", "stiffness")
    push, load_ = Parameter("F", 1.0, "N", "force"), Parameter("N_ring", 0.1, "N", "limit of friction")
    declared = Mechanism.from_matrices(
        r.M,
        r.C,
        r.K,
        name="beam",
        names=r.names,
        contacts=lambda q: [
            Friction(name="ring", slip=q["w10"].v, law=Coulomb(load_, sympy.S.One)),
            Stop(name="stop", gap=gap - q["w20"], law=KelvinVoigt(k=stiff, c=sympy.S.Zero), release="gap"),
        ],
        applied=lambda q: {q["w20"]: push},
    )
    run = simulate(load(declared), 0.8)
    x, t = np.zeros(12), 0.0
    slip, inside = float(run.events[0].before), False
    for event in run.events:
        x, t = followed(r, x, t, event.time, slip, inside), event.time
        # what the run calls an event is one of the reference
        assert abs(x[6] if event.contact == "ring" else x[1] - 0.02) < 1e-9
        slip = float(event.after) if event.contact == "ring" else slip
        inside ^= event.contact == "stop"
        assert slip != 0.0  # the reference knows no stick
    x = followed(r, x, t, 0.8, slip, inside)
    assert {event.contact for event in run.events} == {"ring", "stop"}
    ours = [run[name][-1] for name in (*r.names, *(f"v_{name}" for name in r.names))]
    assert x == pytest.approx(ours, abs=1e-9)


def test_what_modes_left_out_lack_is_told() -> None:
    """Of the tip L^3/(3 EI) is the sum of 4 L^3/(EI (beta L)^4) over all modes."""
    M, K, names = beam(40)
    roots = [*CLAMPED, *(np.pi * (k - 0.5) for k in range(4, 7))]
    for modes in (1, 3, 6):
        lack = 100.0 * (1.0 - 12.0 * sum(root**-4.0 for root in roots[:modes]))
        assert reduced(M, None, K, modes=modes, names=names).residual("w40") == pytest.approx(lack, rel=1e-3)
    kept = reduced(M, None, K, modes=2, names=names, keep=["w40"], diagonal=True)
    assert kept.residual("w40") == pytest.approx(0.0, abs=1e-6) and kept.residual("w7") > 1e-3
    free = reduced(np.eye(2), None, [[1.0, -1.0], [-1.0, 1.0]], modes=2)
    with pytest.raises(StickslipError, match="Nothing holds"):
        free.residual("u1")
    with pytest.raises(StickslipError, match="'w41'"):
        kept.residual("w41")


def test_modes_of_the_reduced_structure_move_as_it_does() -> None:
    M, K, names = beam(12)
    plain = reduced(M, 0.01 * K, K, modes=3, keep=["w6", "w12"], names=names)
    own = reduced(M, 0.01 * K, K, modes=3, keep=["w6", "w12"], names=names, diagonal=True)
    assert own.names == ("mode1", "mode2", "mode3", "mode4", "mode5")
    np.testing.assert_array_equal(own.M, np.eye(5))
    np.testing.assert_allclose(own.basis.T @ K @ own.basis, own.K, atol=1e-9 * own.K.max())
    np.testing.assert_allclose(own.C, 0.01 * own.K, atol=1e-9 * own.K.max())
    flexibility = [r.basis @ np.linalg.solve(r.K, r.basis.T) for r in (plain, own)]
    np.testing.assert_allclose(*flexibility, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("kind", ["ring", "stop"])
@pytest.mark.parametrize(
    ("elements", "modes", "stop"), [(10, 6, 0.9), pytest.param(150, 198, 0.06, marks=pytest.mark.nightly)]
)
def test_many_modes_rub_and_strike_as_their_own_solutions_have_it(
    kind: str, elements: int, modes: int, stop: float
) -> None:
    """Between events a beam without damping is a sum of harmonic motions about a state of rest."""
    M, K, names = beam(elements)
    ring, tip = f"w{elements // 2}", f"w{elements}"
    r = reduced(M, None, K, modes=modes, keep=[ring, tip], names=names, diagonal=True)
    np.testing.assert_allclose(r.omega[:3], CLAMPED**2 * np.sqrt(EI / RHO_A), rtol=1e-3 if elements < 20 else 1e-6)
    at_ring, at_tip = (r.basis[names.index(name)] for name in (ring, tip))
    rest = np.linalg.solve(r.K, at_tip)
    assert rest @ at_tip == pytest.approx(1.0 / (3.0 * EI), rel=1e-6)
    assert rest @ at_ring == pytest.approx(5.0 / (48.0 * EI), rel=1e-6)
    push, load_ = Parameter("F", 1.0, "N", "force"), Parameter("N_ring", 0.02, "N", "limit of friction")
    gap, stiff = Parameter("d", 2e-5 if elements > 20 else 0.02, "m", "gap"), Parameter("k_stop", 500.0, "N/m", "k")
    declared = Mechanism.from_matrices(
        *(r.M, r.C, r.K),
        name=f"beam_{kind}",
        names=r.names,
        contacts=lambda q: [
            Friction(name="ring", slip=r.speed(ring, q), law=Coulomb(load_, sympy.S.One))
            if kind == "ring"
            else Stop(name="stop", gap=gap - r.place(tip, q), law=KelvinVoigt(k=stiff, c=sympy.S.Zero), release="gap")
        ],
        applied=lambda q: {x: push * float(factor) for x, factor in zip(q.values(), at_tip, strict=True)},
    )
    kick = dict(zip((f"v_{name}" for name in r.names), 0.1 * at_ring, strict=True))
    run = simulate(load(declared), stop, start=kick)
    n = len(r.names)
    x, t, state = np.concatenate([np.zeros(n), 0.1 * at_ring]), 0.0, int(kind == "ring")
    times = [*(event.time for event in run.events), stop]
    states = [*(int(event.after) if kind == "ring" else k % 2 == 0 for k, event in enumerate(run.events)), 0]
    assert len(run.events) >= 2
    for time, after in zip(times, states, strict=True):
        if kind == "ring" and state == 0 and t > 0.0:
            break  # the solutions below know no stick
        # by factors of the stiffness: eigh of itself loses low frequencies to rounding of the high ones
        spring = np.sqrt(500.0 * (kind == "stop" and state)) * at_tip
        shapes, omega, _ = svd(np.column_stack([np.sqrt(r.K), spring]), full_matrices=False)
        force = at_tip - (0.02 * state * at_ring if kind == "ring" else 0.0)
        force = force + (500.0 * float(gap.value) * at_tip if kind == "stop" and state else 0.0)
        middle = shapes.T @ force / omega**2
        a, b = shapes.T @ x[:n] - middle, shapes.T @ x[n:] / omega
        cos, sin = np.cos(omega * (time - t)), np.sin(omega * (time - t))
        x = np.concatenate([shapes @ (middle + a * cos + b * sin), shapes @ (omega * (b * cos - a * sin))])
        t, state = time, after
        # what the run calls an event is one of these solutions
        slip, depth = at_ring @ x[n:], at_tip @ x[:n] - float(gap.value)
        assert t == stop or abs(slip if kind == "ring" else depth) < 1e-10
    else:
        ours = [run[f"{v}{name}"][-1] for v in ("", "v_") for name in r.names]
        np.testing.assert_allclose(ours, x, rtol=0.0, atol=1e-10 * abs(x).max())


def test_kept_degrees_stand_last_where_their_mass_is_shared() -> None:
    """The masses of kept degrees with every mode are rows, not a triangle; names of nodes become names of variables."""
    M, K, _ = beam(30)
    nodes = {f"{i // 2 + 1}:{'wt'[i % 2]}": i for i in range(60)}
    r = reduced(M, None, K, modes=20, keep=["15:w", "30:w"], names=nodes)
    hold = Parameter("hold", 1.0, "N", "friction")
    declared = Mechanism.from_matrices(
        *(r.M, r.C, r.K),
        name="beam",
        names=r.names,
        contacts=lambda q: [Friction(name="f", slip=q["30:w"].v, law=Coulomb(hold, sympy.S.One))],
    )
    assert [q.name for q in declared.coordinates][-2:] == ["n15_w", "n30_w"]
    assert len(envelope(lower(declared))) <= 20 + 21 + 22
    assert np.count_nonzero(r.K) <= 20 + 4 and np.count_nonzero(r.M) <= 20 + 2 * 2 * 20 + 4
    # what is banded stays so
    whole = Mechanism.from_matrices(M, None, K, name="whole", names=nodes)
    assert len(envelope(lower(whole))) <= 60 * 4


def test_files_and_what_does_not_fit(tmp_path: Path) -> None:
    M, K, names = beam(3)
    scipy.io.mmwrite(tmp_path / "M.mtx", scipy.sparse.coo_matrix(M))
    np.save(tmp_path / "C.npy", 0.1 * K)
    scipy.io.savemat(tmp_path / "beam.mat", {"K": K})
    files = (tmp_path / "M.mtx", tmp_path / "C.npy", f"{tmp_path / 'beam.mat'}:K")
    there, here = reduced(*files, modes=2), reduced(M, 0.1 * K, K, modes=2)
    np.testing.assert_allclose(there.C, here.C, rtol=1e-9)
    (tmp_path / "rows.csv").write_text("equation, node, dof\n1, 7, uz\n2; 7; rx\n\n3 8 uz\n4 8 rx\n5 9 uz\n6 9 rx\n")
    assert reduced(*files, modes=1, names=tmp_path / "rows.csv").degrees[:3] == ("7:uz", "7:rx", "8:uz")
    (tmp_path / "short.csv").write_text("7\n")
    skew = K.copy()
    skew[0, 1] += 1.0
    for arguments, others, message in [
        ((M, None, K[:4, :4]), {}, "one size"),
        ((M, None, skew), {}, "not symmetric"),
        ((M[:, :3], None, K), {}, "square"),
        ((M - 2 * np.diag(np.diag(M)), None, K), {}, "positive definite"),
        ((M, None, np.full_like(K, np.nan)), {}, "not finite"),
        ((M, None, K), {"keep": ["w4"], "names": names}, "'w4'.*'w3'"),
        ((M, None, K), {"names": ["w"]}, "1 names for 6"),
        ((M, None, K), {"modes": 7}, "6 modes"),
        ((M, None, K), {"names": {"a": 0, "b": 2}}, "rows 0 to 1"),
        ((M, None, K), {"names": tmp_path / "short.csv"}, "node and direction"),
        ((M, None, K), {"names": tmp_path / "none.csv"}, "cannot be read"),
        ((tmp_path / "N.mtx", None, K), {}, "cannot be read"),
        ((f"{tmp_path / 'beam.mat'}:M", None, K), {}, "holds K"),
        (("beam.txt", None, K), {}, "no .mtx"),
    ]:
        with pytest.raises(StickslipError, match=message):
            reduced(*arguments, **{"modes": 1, **others})
    free = np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert reduced(np.eye(3), None, free, modes=1, keep=["u3"]).omega == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(StickslipError, match="rigid motions"):
        reduced(np.eye(3), None, free, modes=0, keep=["u3"])
