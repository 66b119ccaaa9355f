"""A host that traps INVALID, DIVBYZERO and OVERFLOW runs every model, and finds its traps on afterwards."""

from __future__ import annotations

import platform
import subprocess
import sys
from pathlib import Path

import pytest

from fmu_models import oscillators
from fmu_models.codegen.package import FMI_VERSIONS

X86_LINUX = sys.platform == "linux" and platform.machine() == "x86_64"


@pytest.mark.nightly_for("2.0")
@pytest.mark.skipif(not X86_LINUX, reason="feenableexcept is glibc's; the script has the numbers of x86")
@pytest.mark.parametrize("version", FMI_VERSIONS)
def test_every_model_runs(version: str) -> None:
    script = Path(__file__).with_name("trapped_host.py")
    host = subprocess.run([sys.executable, "-X", "faulthandler", script, version], capture_output=True, text=True)
    assert host.returncode == 0, host.stdout + host.stderr
    assert host.stdout.split() == oscillators.names()
