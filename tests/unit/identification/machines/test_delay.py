"""Efforts that a recorder stores late, or early, are told by how much; a delay below half a sample is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from checkout import ROOT
from emulated_arm import ARM, RATE, log

from fmu_models.language.mechanism import Mechanism
from fmu_models.oscillators import load
from identification.machines.inverse import identify_machine
from identification.machines.motion import MachineLog

DATA = ROOT / "data" / "machines"
KNOWN = {"g": ARM["g"], "l1": ARM["l1"]}


@pytest.fixture(scope="module")
def arm() -> Mechanism:
    return load(DATA / "two_link_arm.py")


def late(seed: int, delay: float, noise: float = 0.0) -> MachineLog:
    """A log whose efforts come by so many seconds after its positions, which have noise (rad)."""
    one, rng = log(seed), np.random.default_rng(seed)
    effort = np.stack([np.interp(one.time - delay, one.time, column) for column in one.effort.T], axis=1)
    return replace(one, effort=effort, position=one.position + noise * rng.normal(size=one.position.shape))


@pytest.mark.parametrize(("delay", "order"), [(0.012, "after"), (-0.008, "before")])
def test_a_delay_of_the_efforts_is_told(arm: Mechanism, delay: float, order: str):
    found = identify_machine(arm, [late(1, delay), late(2, delay)], known=KNOWN, method="least squares")
    (said,) = (one for one in found.verdicts if one.startswith("Efforts come"))
    value, _, deviation, unit, found_order = said.split()[2:7]
    assert (unit, found_order) == ("ms", order)
    assert abs(float(value) - 1e3 * abs(delay)) < 4 * float(deviation) < 1e3 * abs(delay)


@pytest.mark.parametrize(("delay", "noise"), [(0.0, 0.0), (0.25 / RATE, 0.0), (0.0, 0.005)])
def test_what_is_no_delay_is_not_told(arm: Mechanism, delay: float, noise: float):
    logs = [late(1, delay, noise), late(2, delay, noise)]
    found = identify_machine(arm, logs, known=KNOWN, method="least squares", cutoff=25.0)
    assert not any("Efforts come" in one for one in found.verdicts)
