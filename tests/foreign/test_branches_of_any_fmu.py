"""Branches of FMUs that others made: within the accuracy that is said, with directional derivatives and without."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from models import foreign

from fmu_models import Strobe, branch, load
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
    assert ("its directional derivatives" in found.how) == directional and "events are not told" in found.how
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
