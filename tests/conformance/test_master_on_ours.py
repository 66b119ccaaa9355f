"""FMUs exported here, driven by the master as if they were anybody's: the same motion as by their own engine."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_models.codegen.package import FMI_VERSIONS, built
from fmu_models.fmu.fmu import Fmu
from fmu_models.importer.simulate import simulate_any
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal

STOP = 25.0
# error of the states at tolerance 1e-10, in their units; measured 3e-9 at most (events magnify the error of the steps)
CASES = [
    (name, version, method)
    for name in ("disc_rig", "discontinuous_support", "two_domain_oscillator")
    for version in FMI_VERSIONS
    for method in ("dopri5", "dop853", "stiff", "co-simulation")
]


def opened(name: str, version: str) -> Fmu:
    contacts = ("disc0",) if name == "disc_rig" else None
    return Fmu.open(built(name, fmi_version=version, contacts=contacts))


@pytest.mark.parametrize(("name", "version", "method"), CASES)
def test_the_same_motion(name: str, version: str, method: str) -> None:
    fmu = opened(name, version)
    own = simulate(fmu, STOP)
    driven = simulate_any(fmu, STOP, method=method, tolerance=1e-10, output_times=own.time)
    bound = 1e-12 if method == "co-simulation" else 2e-8
    for state in fmu.states:
        assert np.abs(driven[state] - own[state]).max() < bound
    if method != "co-simulation":
        assert [e.time for e in driven.events] == pytest.approx([e.time for e in own.events], abs=1e-7)


@pytest.mark.parametrize("version", FMI_VERSIONS)
def test_the_same_motion_under_an_input_that_jumps(version: str) -> None:
    fmu = opened("disc_rig", version)
    w0 = Signal([0.0, 5.0, 5.0, 9.0, STOP], [0.8, 0.8, 0.5, 1.2, 1.2])
    own = simulate(fmu, STOP, inputs={"w0": w0})
    driven = simulate_any(fmu, STOP, tolerance=1e-10, inputs={"w0": w0}, output_times=own.time)
    assert np.abs(driven["theta"] - own["theta"]).max() < 1e-7
    assert "input" in {event.kind for event in driven.events}


@pytest.mark.parametrize("version", FMI_VERSIONS)
def test_a_co_simulation_takes_the_step_that_the_fmu_recommends(version: str) -> None:
    run = simulate_any(opened("disc_rig", version), 0.2, method="co-simulation")
    assert run.time == pytest.approx(np.arange(21) * 0.01, abs=1e-12)
