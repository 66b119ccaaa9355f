"""Branches of FMUs that others made: within the accuracy that is said, with directional derivatives and without."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from models import foreign

from fmu_models import StickslipError, Strobe, branch, load
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu

TABLE_1 = {"ks": 10.0, "omega": 0.8}


def read_as_foreign(path: Path, directional: bool, name: str = "discontinuous_support") -> Fmu:
    """Our own FMU, whose description does not say who made it, nor, if so, that it has directional derivatives."""
    with zipfile.ZipFile(built(name)) as given, zipfile.ZipFile(path, "w") as made:
        for part in given.namelist():
            content = given.read(part)
            if part == "modelDescription.xml":
                content = re.sub(rb'generationTool="[^"]*"', b'generationTool="another"', content)
                if not directional:
                    content = re.sub(rb' provides?DirectionalDerivatives?="true"', b"", content)
            made.writestr(part, content)
    return Fmu.open(path)


def said(how: str) -> tuple[float, float]:
    """How near motions and multipliers are."""
    state, multiplier = re.findall(r"within ([0-9.e+-]+)[,;]", how)
    return float(state), float(multiplier)


@pytest.mark.parametrize("directional", [True, False])
def test_our_own_read_as_foreign(directional, tmp_path):
    theirs = read_as_foreign(tmp_path / "support.fmu", directional)
    assert not theirs.ours
    own = branch(Strobe(load("discontinuous_support"), forcing="omega", parameters=TABLE_1), "omega", (0.8, 1.25))
    known = next(one for one in own.special if one.kind == "fold" and one.value > 1.15)
    before = own.places[own.special.index(known)] - 3
    parameters = {**TABLE_1, "omega": own.values[before]}
    found = branch(
        Strobe(theirs, forcing="omega", parameters=parameters), "omega", (1.15, 1.25), start=own.points[before]
    )
    assert (
        "its directional derivatives" in found.how
    ) == directional and "by the least value of their indicators" in found.how
    states, multipliers = said(found.how)
    assert states < 1e-9 and multipliers < 1e-6
    (fold,) = found.special
    assert fold.kind == "fold"
    # across the fold a state changes by its multiplier's change, there of size one
    assert fold.value == pytest.approx(known.value, abs=10 * states)
    assert np.sort(fold.multipliers.real) == pytest.approx(np.sort(known.multipliers.real), abs=10 * multipliers + 1e-9)
    node = found.nodes[2]
    assert np.abs(own.nodes[0].problem.see(node.z).residual).max() < 10 * states
    ((kind, _), _) = found.ends
    assert kind == "range"


def test_what_nothing_forces(tmp_path):
    fmu = Fmu.open(foreign("van_der_pol", tmp_path, 2))
    found = branch(Strobe(fmu, period=6.66, autonomous=True), "mu", (0.9, 1.0), start={"x": 2.0, "v": 0.0})
    # of a series of 50 digits
    assert found.periods[-1] == pytest.approx(6.66328685932313, abs=1e-9) and found.values[-1] == 1.0


def test_grazings_are_located(tmp_path):
    """The motion that does not reach the support has the amplitude f0/|1 - omega^2 + i c omega|: it grazes where that
    is the gap. From within the contact, beside a fold that is 2.6e-7 from it, it is found too."""
    c, f0, gap = 0.05, 0.5, 4.0
    squared = np.roots([1.0, c**2 - 2.0, 1.0 - (f0 / gap) ** 2])
    fmu, omega = Fmu.open(foreign("support", tmp_path, 3)), 0.93
    strobe = Strobe(fmu, forcing="omega", parameters={"omega": omega, "ks": 10.0})
    steady = f0 / complex(1.0 - omega**2, c * omega)
    start = {"x": steady.real, "v": -omega * steady.imag}
    found = branch(strobe, "omega", (omega, 1.2), start=start)
    grazings = [one for one in found.special if one.kind == "grazing"]
    assert [one.value for one in grazings] == pytest.approx(sorted(np.sqrt(squared)), abs=1e-9)
    for one, (without, touching) in zip(grazings, ((0, 1), (1, 0)), strict=True):
        assert one.contact == "indicator 1" and not one.words[without] and one.words[touching]
    own = branch(
        Strobe(load("discontinuous_support"), forcing="omega", parameters=strobe.values), "omega", (omega, 1.2)
    )
    folds = [[one.value for one in some.special if one.kind == "fold"] for some in (own, found)]
    assert len(folds[0]) == 2 and folds[1] == pytest.approx(folds[0], abs=1e-9)
    with pytest.raises(StickslipError, match="A grazing of an FMU of others has no curve"):
        grazings[0].curve("g")
