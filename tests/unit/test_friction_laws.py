"""Friction laws to be fitted: gradients, starts from data, warnings, and the laws of the FMU that simulate them."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import variant
from fmu_models.language.contacts import Friction
from fmu_models.language.dry_friction import DryFriction
from identification.laws import LAWS, find_law

VALUES = {
    "Coulomb": (0.4,),
    "Coulomb+viscous": (0.4, 0.7),
    "Conti": (0.65, 0.35, 15.0),
    "Conti+viscous": (0.65, 0.35, 15.0, 0.7),
    "Stribeck": (0.65, 0.35, 0.06),
}
SLIP = np.linspace(0, 0.3, 31)


def test_every_law_is_tried() -> None:
    assert VALUES.keys() == LAWS.keys()


@pytest.mark.parametrize("name", VALUES)
def test_gradient_is_the_derivative(name: str) -> None:
    law, q = LAWS[name], np.array(VALUES[name])
    exact = law.gradient(SLIP.reshape(1, -1), q)
    assert exact.shape == (len(q), 1, len(SLIP))
    for place in range(len(q)):
        step = 1e-6 * q[place] * np.eye(len(q))[place]
        slope = (law.value(SLIP, q + step) - law.value(SLIP, q - step)) / (2 * step[place])
        np.testing.assert_allclose(exact[place, 0], slope, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("name", VALUES)
@settings(max_examples=20, deadline=None)
@given(scale=st.floats(0.3, 3.0))
def test_a_start_from_exact_data_is_near(name: str, scale: float) -> None:
    law, q = LAWS[name], np.array(VALUES[name]) * np.array([1, 1, scale, 1])[: len(VALUES[name])]
    found = law.start(SLIP[1:], law.value(SLIP[1:], q))
    assert found.shape == q.shape
    np.testing.assert_allclose(law.value(SLIP, found), law.value(SLIP, q), atol=0.03)


@pytest.mark.parametrize("name", VALUES)
def test_the_law_of_the_fmu_is_the_fitted_one(name: str) -> None:
    law, q, normal = LAWS[name], np.array(VALUES[name]), 4.905
    laws = None if law.model is None else {"disc0": law.model}
    rig = variant("disc_rig", ["disc0"], laws)
    contact = rig.contacts[0]
    assert isinstance(contact, Friction) and isinstance(contact.law, DryFriction)
    given = {f"{key}0": value for key, value in law.simulated(q, normal).items()} | {"N0": normal}
    values = [(s, sympy.Float(given[str(s)])) for s in contact.symbols if str(s) in given]
    force = [float(contact.law.magnitude(sympy.Float(v)).subs(values)) for v in SLIP]
    np.testing.assert_allclose(force, normal * law.value(SLIP, q), rtol=1e-12)


@pytest.mark.parametrize("name", VALUES)
def test_what_is_simulated_is_linear_in_the_parameters(name: str) -> None:
    law, q = LAWS[name], np.array(VALUES[name])
    whole = law.simulated(q, 3.0)
    parts = [law.simulated(row, 3.0) for row in np.diag(q)]
    assert whole == pytest.approx({key: sum(part[key] for part in parts) for key in whole})


@pytest.mark.parametrize("name", ["Conti", "Conti+viscous", "Stribeck"])
def test_rising_friction_is_warned_of(name: str) -> None:
    q = np.array(VALUES[name])
    assert LAWS[name].warnings(q) == ()
    q[:2] = 0.3, 0.4
    (said,) = LAWS[name].warnings(q)
    assert "rises with slip speed" in said and "Coulomb+viscous" in said


def test_an_unknown_law_is_refused_with_the_nearest() -> None:
    with pytest.raises(StickslipError, match=r"no friction law 'conti'\. Did you mean 'Conti'\?"):
        find_law("conti")
