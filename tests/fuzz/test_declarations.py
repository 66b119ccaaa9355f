"""The reference of random declarations against closed forms, and a wrong answer of ours that is found and shrunk."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from collections import Counter
from pathlib import Path

import declarations
import numpy as np
import pytest
from declarations import Model, check, minimal, shrunk
from fuzzing import generator
from oracle.declaration import Declaration, Values
from oracle.equations import Equations
from oracle.motion import run
from oracle.random_declarations import declaration, values

BALL = Declaration(
    states=("q0",),
    parameters=("G", "e"),
    kinetic="v0**2/2",
    potential="q0",
    contacts=[{"kind": "impact", "name": "table", "gap": "q0 - G*sin(t)", "rule": "newton", "e": "e"}],
)
BELT = Declaration(
    states=("q0",),
    parameters=("mu", "c"),
    kinetic="v0**2/2",
    potential="q0**2/2",
    dissipation="c*v0**2/2",
    contacts=[
        {"kind": "friction", "name": "belt", "slip": "v0 - 1/2", "law": {"name": "coulomb", "N": "1", "mu": "mu"}}
    ],
)
BELT_RUN = Values(3.0, {"mu": 0.5, "c": 0.0}, {"q0": 0.0, "v0": -0.5})


def test_the_reference_follows_a_chatter_to_its_end() -> None:
    """Of a ball on a table G sin t, G = 1/2; at its end it rests on the table."""
    found = run(Equations(BALL), Values(3.0, {"G": 0.5, "e": 0.5}, {"q0": 0.0, "v0": 1.0}), [3.0])
    assert not found.reason
    assert found.events[-1][0] == pytest.approx(2.6817425236699174, abs=1e-4)
    assert found.states[-1] == pytest.approx([0.5 * np.sin(3.0), 0.5 * np.cos(3.0)], abs=1e-7)


def test_the_reference_sticks_and_slips_as_in_closed_form() -> None:
    """On a belt of speed 1/2: q = (1 - cos t - sin t)/2 up to t = pi/2, with the belt for 1 s, then free to swing."""
    found = run(Equations(BELT), BELT_RUN, [1.0, 2.0, 3.0])
    assert [event[0] for event in found.events] == pytest.approx([np.pi / 2, np.pi / 2 + 1], abs=1e-10)
    swing = 3.0 - np.pi / 2 - 1
    expected = [(1 - np.cos(1) - np.sin(1)) / 2, (2.0 - np.pi / 2) / 2, (1 + np.sin(swing)) / 2]
    assert found.states[:, 0] == pytest.approx(expected, abs=1e-10)


@pytest.mark.nightly
def test_a_wrong_run_is_found_shrunk_and_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = Model(BELT, BELT_RUN.parameters, tmp_path)
    assert check(model, BELT_RUN, Counter(), True) is None
    right = Model.ours

    def wrong(self: Model, drawn: Values, times: object = None) -> object:
        moved = {**drawn.parameters, "mu": 1.00001 * drawn.parameters["mu"]}
        return right(self, dataclasses.replace(drawn, parameters=moved), times)

    monkeypatch.setattr(Model, "ours", wrong)
    found = check(model, BELT_RUN, Counter(), True)
    assert found and found[0] == "simulate" and "off by" in found[1]
    monkeypatch.setattr(declarations, "SHRINKS", 4)
    small, drawn, message = shrunk(BELT, BELT_RUN, "simulate", tmp_path)
    assert "off by" in message and "c*v0" not in small.dissipation and "c" not in drawn.parameters
    file = tmp_path / "alone.py"
    file.write_text(minimal(small, drawn), "utf-8")
    done = subprocess.run([sys.executable, str(file)], capture_output=True, text=True, check=True)
    for line in done.stdout.splitlines():
        _, ours, reference = line.split()
        assert float(ours) == pytest.approx(float(reference), abs=1e-9)


def test_a_draw_depends_on_its_number_alone() -> None:
    def drawn(number: int) -> tuple[Declaration, Values]:
        source = generator("declarations", 3, number)
        declared, draw = declaration(source)
        return declared, values(declared, draw, source)

    assert drawn(5) == drawn(5)
    kinds = {contact["kind"] for number in range(40) for contact in drawn(number)[0].contacts}
    assert kinds == {"friction", "stop", "impact", "switch", "sliders"}
