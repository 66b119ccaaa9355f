"""Equilibria of FMUs that others made: against closed forms, and our own read as foreign."""

from __future__ import annotations

import numpy as np
import pytest
from models import foreign
from test_branches_of_any_fmu import read_as_foreign

from fmu_models import StickslipError, equilibria
from fmu_models.fmu.fmu import Fmu


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_oscillator_of_van_der_pol(fmi, tmp_path):
    """At rest at 0, lambda^2 - mu lambda + 1 = 0."""
    fmu = Fmu.open(foreign("van_der_pol", tmp_path, fmi))
    found = equilibria(fmu, "mu", (-1.0, 1.5), start={"x": 0.1, "v": 0.0}, parameters={"mu": 0.5})
    (hopf,) = found.special
    assert hopf.kind == "Hopf" and hopf.value == pytest.approx(0.0, abs=1e-12)
    assert hopf.criticality == "degenerate or undecided"  # mu = 0 leaves a linear equation
    assert hopf.frequency == pytest.approx(1.0, abs=1e-12)
    assert np.abs(found.points).max() < 1e-12 and (found.stable == (found.values < 0.0)).all()
    mu = found.values[:, None]
    assert found.eigenvalues == pytest.approx((mu + np.sqrt(4.0 - mu**2) * [1j, -1j]) / 2.0, abs=1e-9)
    assert "its directional derivatives" in found.how


@pytest.mark.parametrize("directional", [True, False])
def test_a_surface_of_an_fmu_whose_variables_tell_it(directional, tmp_path):
    fmu = read_as_foreign(tmp_path / "hopf.fmu", directional, "planar_hopf")
    found = equilibria(fmu, "mu", (-1, 1), start={"x1": -1.5, "x2": 0.0})
    (special,) = found.special
    assert special.kind == "discontinuous Hopf" and special.contact == "kink_state"
    assert special.value == pytest.approx(0.0, abs=1e-12)
    assert special.crossings["imaginary axis"] == pytest.approx([1 / 6], abs=1e-12 if directional else 1e-8)
    assert found.points[:, 0] == pytest.approx(-1.5 * np.abs(found.values), abs=1e-9)
    assert ("its directional derivatives" in found.how) == directional
    with pytest.raises(StickslipError, match="No branch was found"):
        special.switch()


def test_cycles_leave_at_a_hopf_point(tmp_path):
    fmu = read_as_foreign(tmp_path / "smooth.fmu", True, "planar_multiple_crossing_smooth")
    found = equilibria(fmu, "mu", (-0.01, 0.01), start={"x1": -0.05, "x2": 0.0})
    hopf, fold = found.special
    assert (hopf.kind, hopf.criticality, fold.kind) == ("Hopf", "subcritical", "fold")
    assert hopf.value == pytest.approx(0.0025561976547262552, abs=1e-12)
    (cycles,) = hopf.switch(points=2)
    assert cycles.values[0] < hopf.value and not cycles.stable[0]


def test_what_is_forced_has_none(tmp_path):
    with pytest.raises(StickslipError, match="is forced"):
        equilibria(Fmu.open(foreign("forced", tmp_path, 3)), "d", (0.05, 0.2))
