"""The sources in an FMU build by their own CMakeLists.txt without a warning, and give what our library gives."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest

from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.toolchain.compiler import fmi_headers


@pytest.mark.parametrize(("model", "version"), [("block_on_belt", "3.0")])
def test_cmake_builds_what_we_build(tmp_path: Path, model: str, version: str) -> None:
    if shutil.which("cmake") is None or shutil.which("cc") is None:
        pytest.skip("needs cmake and a C compiler of the system")
    ours = built(model, fmi_version=version)
    folder = tmp_path / "fmu"
    with zipfile.ZipFile(ours) as archive:
        archive.extractall(folder)
    shipped = [p.relative_to(folder) for p in (folder / "binaries").rglob("*.*")]
    shutil.rmtree(folder / "binaries")
    sources = ["cmake", "-S", folder / "sources", "-B", tmp_path / "build"]
    strict = "-Wall -Wextra -Wpedantic -Werror"

    def run(*command: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)

    lost = run(*sources)
    assert lost.returncode and f"fmi{version[0]}Functions.h is not in ''" in " ".join(lost.stderr.split())
    for command in (
        [*sources, f"-DFMI_HEADERS={fmi_headers()}", f"-DCMAKE_C_FLAGS={strict}"],
        ["cmake", "--build", tmp_path / "build"],
        ["cmake", "--install", tmp_path / "build"],
    ):
        done = run(*command)
        assert done.returncode == 0, done.stdout + done.stderr
    assert [p.relative_to(folder) for p in (folder / "binaries").rglob("*.*")] == shipped
    one, other = (simulate(fmu, stop_time=5.0) for fmu in (Fmu.open(ours), Fmu.unpacked(ours, folder)))
    assert len(one.events) == len(other.events) > 0
    for name, values in one.values.items():
        np.testing.assert_allclose(other.values[name], values, rtol=1e-12, atol=1e-12)
