"""Friction laws to be fitted: functions from the declarations against the formulas, starts from data, and warnings."""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from checkout import ROOT
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_models.base.errors import StickslipError
from identification.laws import find_law, slip_laws
from identification.laws.joint_law import joint_law

VALUES = {
    "Coulomb": (0.4,),
    "Coulomb+viscous": (0.4, 0.7),
    "Dieterich": (0.5, 0.02),
    "Conti": (0.65, 0.35, 15.0),
    "Tustin": (0.65, 0.35, 0.06),
    "Conti+viscous": (0.65, 0.35, 15.0, 0.7),
    "Stribeck+viscous": (0.65, 0.35, 0.06, 0.7),
}
SLIP = np.linspace(0, 0.3, 31)


def conti(v: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    left = 1 / (1 + q[2] * v)
    return (q[0] - q[1]) * left + q[1], np.stack([left, 1 - left, -(q[0] - q[1]) * v * left**2])


def tustin(v: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    left = np.exp(-v / q[2])
    return q[1] + (q[0] - q[1]) * left, np.stack([left, 1 - left, (q[0] - q[1]) * left * v / q[2] ** 2])


def gauss(v: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    left = np.exp(-((v / q[2]) ** 2))
    return q[1] + (q[0] - q[1]) * left, np.stack([left, 1 - left, 2 * (q[0] - q[1]) * left * v**2 / q[2] ** 3])


def dieterich(v: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    log = np.log((v + 1e-6) / 0.05)
    return q[0] - q[1] * log, np.stack([np.ones_like(v), -log])


def viscous(v: np.ndarray, dry: tuple[np.ndarray, np.ndarray], mu_v: float) -> tuple[np.ndarray, np.ndarray]:
    return dry[0] + mu_v * v, np.concatenate([dry[1], v[None]])


# written by hand: mu and its gradient
FORMULAS: dict[str, Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]] = {
    "Coulomb": lambda v, q: (np.full_like(v, q[0]), np.ones((1, *v.shape))),
    "Coulomb+viscous": lambda v, q: (q[0] + q[1] * v, np.stack([np.ones_like(v), v])),
    "Dieterich": dieterich,
    "Conti": conti,
    "Tustin": tustin,
    "Stribeck+viscous": lambda v, q: viscous(v, gauss(v, q), q[3]),
    "Conti+viscous": lambda v, q: viscous(v, conti(v, q), q[3]),
    "LuGre": lambda v, q: (conti(v, q)[0], np.concatenate([conti(v, q)[1], np.zeros((2, *v.shape))])),
}


def test_every_law_is_tried() -> None:
    assert list(VALUES) == list(slip_laws()), "the simplest first"


@pytest.mark.parametrize("name", FORMULAS)
@pytest.mark.parametrize("scale", [0.1, 1.0, 7.0])
def test_functions_of_the_declaration_are_the_formulas(name: str, scale: float) -> None:
    law = find_law(name)
    q = np.array({**VALUES, "LuGre": (0.65, 0.35, 15.0, 2e5, 100.0)}[name])
    q[-1] *= scale
    value, gradient = FORMULAS[name](SLIP, q)
    # sums and products in another order: a rounding each, of numbers that are themselves rounded
    np.testing.assert_allclose(law.value(SLIP, q), value, rtol=np.finfo(float).eps, atol=1e-16)
    np.testing.assert_allclose(law.gradient(SLIP, q), gradient, rtol=4 * np.finfo(float).eps, atol=1e-16)
    windows = SLIP[1:].reshape(5, 6)
    assert law.value(windows, q).shape == (5, 6)
    assert law.gradient(windows, q).shape == (len(q), 5, 6)
    np.testing.assert_array_equal(law.gradient(windows, q).reshape(len(q), -1), law.gradient(SLIP[1:], q))


@pytest.mark.parametrize("name", VALUES)
@settings(max_examples=20, deadline=None)
@given(scale=st.floats(0.3, 3.0))
def test_a_start_from_exact_data_is_near(name: str, scale: float) -> None:
    law, q = slip_laws()[name], np.array(VALUES[name]) * np.array([1, 1, scale, 1])[: len(VALUES[name])]
    found = law.start(SLIP[1:], law.value(SLIP[1:], q))
    assert found.shape == q.shape
    np.testing.assert_allclose(law.value(SLIP, found), law.value(SLIP, q), atol=0.04)


def test_a_part_of_a_law_that_no_parameter_scales_is_not_sought() -> None:
    law = find_law("Coulomb+viscous")
    raised = replace(law, value=lambda speed, q: 0.2 + law.value(speed, q))
    assert raised.start(SLIP, 0.6 + 0.5 * SLIP) == pytest.approx([0.4, 0.5], rel=1e-12)


def test_what_mu_does_not_tell_starts_at_its_default() -> None:
    law, q = find_law("LuGre"), np.array([0.65, 0.35, 15.0, 5e5, 40.0])
    assert list(law.start(SLIP, law.value(SLIP, q))[3:]) == [2e5, 100.0]


@pytest.mark.parametrize("name", ["Conti", "Conti+viscous", "Tustin", "Stribeck+viscous", "LuGre"])
def test_rising_friction_is_warned_of(name: str) -> None:
    law = find_law(name)
    q = np.array([one.value for one in law.parameters])
    assert law.warnings(q) == ()
    q[:2] = 0.3, 0.4
    (said,) = law.warnings(q)
    assert said.startswith("mu_s = 0.3 is less than mu_k = 0.4: ")
    assert f"which the {name} law does not mean" in said and "Coulomb+viscous" in said


def test_friction_at_rest_is_a_parameter_of_the_laws_that_are_flat_there() -> None:
    named = {name: law.names[law.at_rest] for name, law in slip_laws().items() if law.at_rest is not None}
    falling = dict.fromkeys(("Conti", "Tustin", "Conti+viscous", "Stribeck+viscous"), "mu_s")
    assert named == {"Coulomb": "mu", "Coulomb+viscous": "mu", **falling}


def test_an_unknown_law_is_refused_with_the_nearest() -> None:
    with pytest.raises(StickslipError, match=r"no friction law 'Conty'\. Did you mean 'Conti'\?"):
        find_law("Conty")


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("stribeck_cubic", "its force .* is not in proportion to the load N"),
        ("tanh", "it declares no steady friction of its own"),
        ("kelvin_voigt", "it declares no steady friction of its own"),
    ],
)
def test_a_law_that_cannot_be_fitted_says_why(name: str, reason: str) -> None:
    with pytest.raises(StickslipError, match=f"The law '{name}' cannot be fitted: {reason}"):
        find_law(name)


def test_laws_are_known_by_the_names_of_their_files_too() -> None:
    assert find_law("tustin").name == "Tustin"


def test_a_law_goes_to_another_process() -> None:
    for law in (find_law("Conti"), joint_law(find_law("Tustin"), "sequential")):
        again = pickle.loads(pickle.dumps(law))
        q, v = np.full(len(law.parameters), 0.3), np.full((4, 2), 0.1)
        np.testing.assert_array_equal(again.value(v, q), law.value(v, q))


@pytest.mark.nightly
def test_functions_are_made_once_and_then_without_sympy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path))
    script = "import sys; from identification.laws import find_law; find_law('Conti'); print('sympy' in sys.modules)"

    def start() -> subprocess.Popen[str]:
        return subprocess.Popen([sys.executable, "-c", script], cwd=ROOT, stdout=subprocess.PIPE, text=True)

    # two at once make them both, and neither sees half a file
    first = [one.communicate()[0].strip() for one in (start(), start())]
    assert "True" in first
    assert start().communicate()[0].strip() == "False"
    # with its hash
    assert sorted(path.suffix for path in (tmp_path / "laws").iterdir()) == [".py", ".sha256"]
