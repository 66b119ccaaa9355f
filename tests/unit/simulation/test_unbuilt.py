"""A model that is not built yet: its core makes the runs of its library, and the whole is there when asked for."""

from __future__ import annotations

import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest

from fmu_models import Coordinate, KeptRun, Mechanism, Parameter, SensitiveRun, export, load, simulate
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.library import platforms
from fmu_models.fmu.unbuilt import UnbuiltFmu
from fmu_models.simulation.engine import engine_of
from fmu_models.toolchain import compiler

NIGHTLY = [pytest.param(name, marks=pytest.mark.nightly) for name in ("disc_rig", "impact_pair", "woodpecker")]
NIGHTLY += [
    pytest.param(name, marks=pytest.mark.nightly) for name in ("discontinuous_support", "bouncing_ball", "drive_motor")
]


def unbuilt(model: str, folder: Path, fmi_version: str = "3.0") -> UnbuiltFmu:
    """A model that is shipped as if it were not built."""
    file = built(model, fmi_version=fmi_version)
    with zipfile.ZipFile(file) as whole, zipfile.ZipFile(folder / "packed.fmu", "w") as packed:
        for name in whole.namelist():
            if not name.startswith("binaries/"):
                packed.writestr(name, whole.read(name))
    return UnbuiltFmu(folder / "packed.fmu", lambda: file)


@pytest.mark.parametrize("model", ["block_on_belt", *NIGHTLY])
def test_the_core_makes_the_same_runs(model: str, tmp_path: Path) -> None:
    core, whole = unbuilt(model, tmp_path), Fmu.open(built(model))
    times = np.linspace(0.0, 10.0, 1001)
    for one, other in (
        (simulate(core, 10.0, output_times=times), simulate(whole, 10.0, output_times=times)),
        (KeptRun(core)(7.0), KeptRun(whole)(7.0)),
    ):
        for name, values in other.values.items():
            np.testing.assert_array_equal(np.asarray(one[name]), np.asarray(values))
        assert one.events == other.events and (one.steps, one.evaluations) == (other.steps, other.evaluations)
    assert "path" not in vars(core) and not (core.folder / "binaries").exists()


def test_what_needs_more_than_the_core_has_the_whole(tmp_path: Path) -> None:
    fmu, whole = unbuilt("block_on_belt", tmp_path), Fmu.open(built("block_on_belt"))
    assert simulate(fmu, 1.0).values and "built when" in repr(fmu) and "path" not in vars(fmu)
    ours, theirs = (SensitiveRun(f, by=["k"]).run(2.0) for f in (fmu, whole))
    np.testing.assert_array_equal(ours.derivative, theirs.derivative)
    assert fmu.path == whole.path and "built when" not in repr(fmu) and fmu.core is None
    assert engine_of(fmu, runs_alone=True) is engine_of(fmu)
    assert pickle.loads(pickle.dumps(fmu)).sha256 == whole.sha256


def test_its_platforms_are_those_of_the_whole(tmp_path: Path) -> None:
    assert platforms(unbuilt("block_on_belt", tmp_path)) == platforms(Fmu.open(built("block_on_belt")))


def test_a_run_compiles_the_core_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled: list[str] = []
    run = compiler.subprocess.run

    def recorded(command: list[str], **options: object) -> object:
        compiled.extend(part for part in command if part.endswith(".c"))
        return run(command, **options)  # type: ignore[call-overload]

    monkeypatch.setattr(compiler.subprocess, "run", recorded)
    m, k = (
        Parameter("m", 1.0, "kg", "mass"),
        Parameter("k", 4.0 + 1e-9 * np.random.default_rng().integers(1 << 30), "N/m", "stiffness"),
    )
    x = Coordinate("x", "m", "displacement", velocity="v", nominal=1.0, v_nominal=1.0)
    spring = Mechanism(
        name="unbuilt_spring", title="Mass on a spring", source="test", coordinates=[x],
        kinetic_energy=m * x.v**2 / 2, potential_energy=k * x**2 / 2,
    )  # fmt: skip
    fmu = load(spring)
    assert isinstance(fmu, UnbuiltFmu) and compiled == []
    trajectory = simulate(fmu, 3.0, start={"x": 1.0})
    np.testing.assert_allclose(trajectory["x"], np.cos(np.sqrt(k.value) * trajectory.time), rtol=0, atol=1e-12)
    assert compiled == ["core.c"]
    assert fmu.path.read_bytes() == export(spring, tmp_path / "unbuilt_spring.fmu").read_bytes()
    assert compiled == ["core.c", "all.c"]
    assert not isinstance(load(spring), UnbuiltFmu)
