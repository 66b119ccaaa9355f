"""What a run with derivatives refuses, and what it says then."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from lazy_fmu import LazyFmu

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import SensitiveRun
from fmu_models.simulation.signal import Signal

RIG = LazyFmu("disc_rig", contacts=("disc0",))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"by": ["mu_k"]}, "no parameter, state or input 'mu_k'. Did you mean 'mu_k0'"),
        ({"by": ["F0"]}, "no parameter, state or input 'F0'"),
        ({"by": ["J", "theta", "J"]}, "'J' is to be differentiated by twice. Name it once."),
        ({"by": []}, "Name at least one parameter, state or input to differentiate by; or use simulate."),
        ({"by": ["J"], "recorded": ["thetta"]}, "no state or output 'thetta'. Did you mean 'theta'"),
        ({"by": ["J"], "recorded": ["w0"]}, "no state or output 'w0'"),
        ({"by": ["J"], "recorded": ["F0", "F0"]}, "'F0' is to be recorded twice"),
        ({"by": ["J"], "tolerance": 0.0}, "The tolerance must be a positive number, found 0"),
        ({"by": ["J"], "tolerance": float("nan")}, "The tolerance must be a positive number, found nan"),
    ],
)
def test_what_cannot_be_asked_of_an_fmu(options, message):
    with pytest.raises(StickslipError, match=re.escape(message)):
        SensitiveRun(RIG, **options)


@pytest.fixture(scope="module")
def kept():
    with SensitiveRun(RIG, by=["J", "theta"], recorded=["theta", "F0"]) as run:
        yield run


@pytest.mark.parametrize(
    ("times", "options", "message"),
    [
        ([0.2, 0.1], {}, "Output times must be finite and ascending. Sort them."),
        ([], {}, "Output times must be a list of numbers, found shape (0,)"),
        ([[0.1]], {}, "found shape (1, 1)"),
        ([0.1, np.inf], {}, "Output times must be finite"),
        ([0.1, 0.2], {"start_time": 0.15}, "Output times from 0.1 s to 0.2 s leave the run from 0.15 s"),
        ([0.1], {"start_time": np.nan}, "The start time must be a finite number of seconds, found nan"),
        ([0.1], {"parameters": {"mu": 0.5}}, "no parameter 'mu'. Did you mean 'mu_s0'"),
        ([0.1], {"start": {"omga": 0.5}}, "no state 'omga'. Did you mean 'omega'"),
        ([0.1], {"inputs": {"w1": 0.5}}, "no input 'w1'"),
        ([0.1], {"parameters": {"J": -1.0}}, "'J' (moment of inertia of the body) must be"),
        ([0.1], {"parameters": {"J": np.inf}}, "The value of 'J' must be a finite number"),
        ([0.1], {"parameters": {"mu_k0": 0.9}}, "mu_k0 exceeds mu_s0"),
        ([0.1, 5.0], {"inputs": {"w0": Signal([0, 1], [1, 1])}}, "covers 0 s to 1 s, the run 0 s to 5 s"),
    ],
)
def test_what_cannot_be_run(kept, times, options, message):
    with pytest.raises(StickslipError, match=re.escape(message)):
        kept.run(times, **options)


def test_after_a_refusal_the_next_run_is_sound(kept):
    with pytest.raises(StickslipError):
        kept.run([0.1], parameters={"mu_k0": 0.9})
    found = kept.run([0.0, 0.5], start={"theta": 0.05})
    plain = simulate(RIG, 0.5, start={"theta": 0.05}, output_times=[0.0, 0.5])
    assert found["theta"] == pytest.approx(plain["theta"], abs=1e-15)
    assert found["F0"] == pytest.approx(plain["F0"], abs=1e-13)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_a_looser_tolerance_is_followed(kept, tolerance):
    """Local errors of some hundred steps add up to between a tenth of the tolerance and a hundred of it."""
    times, start = np.linspace(0.0, 20.0, 41), {"theta": 0.05}
    with SensitiveRun(RIG, by=["J", "theta"], recorded=["theta"], tolerance=tolerance) as loose:
        run, exact = loose.run(times, start=start), kept.run(times, start=start)
    for found, expected in ((run["theta"], exact["theta"]), (run.of("theta"), exact.of("theta"))):
        error = np.max(np.abs(found - expected)) / np.max(np.abs(expected))
        assert tolerance / 10 < error < 100 * tolerance


def test_names_that_were_not_recorded(kept):
    found = kept.run([0.1])
    assert found.of("F0").shape == (1, 2)
    for read in (found.of, found.__getitem__):
        with pytest.raises(StickslipError, match="has not recorded 'omega'"):
            read("omega")


def test_a_closed_run_says_so():
    run = SensitiveRun(RIG, by=["J"])
    run.close()
    run.close()
    with pytest.raises(StickslipError, match=r"are closed\. Open a SensitiveRun again"):
        run.run([0.1])


@pytest.mark.parametrize("fmi_version", ["2.0", "3.0"])
def test_both_versions_of_fmi_give_the_same(fmi_version):
    with SensitiveRun(RIG, by=["J"]) as one:
        expected = one.run([0.3])
    with SensitiveRun(Fmu.open(built("disc_rig", contacts=("disc0",), fmi_version=fmi_version)), by=["J"]) as other:
        assert np.array_equal(other.run([0.3]).derivative, expected.derivative)


STOPPED = """
import sys
import numpy as np
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.sensitivity import SensitiveRun

with SensitiveRun(Fmu.open(sys.argv[1]), by=["J", "theta"], recorded=["theta", "F0"]) as kept:
    expected = kept.run([0.3])
    try:
        print("begun", flush=True)
        while True:
            kept.run([1e6], parameters={"c": 0.0}, inputs={"w0": 1e3})
    except KeyboardInterrupt:
        assert np.array_equal(kept.run([0.3]).derivative, expected.derivative)
        print("sound")
"""


def test_a_long_run_can_be_stopped_and_the_next_one_is_sound():
    """Ctrl-C, sent while the engine works, waits for no event and no end: this body swings freely. In a process of its
    own: whatever comes of the signal, it ends no other test."""
    room = os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])}
    line = [sys.executable, "-c", STOPPED, str(built("disc_rig", contacts=("disc0",)))]
    with subprocess.Popen(line, env=room, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "begun\n"
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=60)[0] == "sound\n"
    assert process.returncode == 0
