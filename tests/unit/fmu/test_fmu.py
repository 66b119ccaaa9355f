"""An opened FMU: its folder, and libraries that are missing or not ours."""

from __future__ import annotations

import gc
import re
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.library import sources
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import SensitiveRun


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match="no file"):
        Fmu.open(tmp_path / "absent.fmu")


def test_the_folder_goes_with_the_object() -> None:
    opened = Fmu.open(built("block_on_belt"))
    folder = opened.folder
    assert (folder / "modelDescription.xml").is_file()
    del opened
    gc.collect()
    assert not folder.exists()


def test_the_engine_stays_packed_until_something_is_built_of_it(tmp_path: Path) -> None:
    path = tmp_path / "model.fmu"
    shutil.copyfile(built("block_on_belt"), path)
    fmu = Fmu.open(path)
    inside = {file.relative_to(fmu.folder).as_posix() for file in fmu.folder.rglob("*") if file.is_file()}
    with zipfile.ZipFile(path) as packed:
        names = {name: packed.read(name) for name in packed.namelist()}
    path.unlink()
    assert names.keys() - inside == {name for name in names if re.match("sources/.*/", name)}
    assert fmu.sources == fmu.sources != fmu.folder / "sources"
    kept = fmu.sources
    assert {f"sources/{file.relative_to(kept).as_posix()}": file.read_bytes() for file in kept.rglob("*.*")} == {
        name: content for name, content in names.items() if name.startswith("sources/")
    }
    assert Fmu.unpacked(path, kept.parent).sources == kept != Fmu.unpacked(path, fmu.folder).sources
    del fmu
    gc.collect()
    assert not kept.exists()


def test_an_fmu_of_somebody_else_is_not_simulated(tmp_path: Path) -> None:
    from fmu_models.toolchain.compiler import compile_shared, fmi_headers
    from fmu_models.toolchain.platforms import this_platform

    path = tmp_path / "foreign.fmu"
    with zipfile.ZipFile(built("block_on_belt")) as source:
        contents = {name: source.read(name) for name in source.namelist()}
    platform, _, _, suffix = this_platform()
    # the same FMU without its whole runs
    sources = {n.removeprefix("sources/"): data.decode() for n, data in contents.items() if n.endswith((".c", ".h"))}
    sources["all.c"] = re.sub(r'#include "(whole_run|ensemble)/\w+.c"\n', "", sources["all.c"])
    library = compile_shared(sources, tmp_path / "library")
    assert fmi_headers().is_dir()
    contents[f"binaries/{platform}/block_on_belt{suffix}"] = library.read_bytes()
    with zipfile.ZipFile(path, "w") as target:
        for name, data in contents.items():
            target.writestr(name, data)
    with pytest.raises(StickslipError, match="not exported by stickslip"):
        simulate(Fmu.open(path), 1.0)
    with pytest.raises(StickslipError, match="not exported by stickslip"):
        SensitiveRun(Fmu.open(path), by=["k"])


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_directional_derivatives_are_known_in_both_versions(version: str) -> None:
    description = Fmu.open(built("block_on_belt", fmi_version=version)).description
    assert description.modelExchange and description.coSimulation
    assert description.modelExchange.providesDirectionalDerivative
    assert description.coSimulation.providesDirectionalDerivative


def repacked(path: Path, version: str, keep: str, **changed: str) -> Path:
    """block_on_belt with the entries whose names match ``keep``, some of them with other text."""
    with zipfile.ZipFile(built("block_on_belt", fmi_version=version)) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            if re.match(keep, name):
                target.writestr(name, changed.get(Path(name).stem, source.read(name)))
    return path


def test_a_platform_without_binary(tmp_path: Path) -> None:
    path = repacked(tmp_path / "a.fmu", "3.0", "modelDescription.xml")
    with pytest.raises(StickslipError, match=r"it has no platform at all.* and no sources"):
        simulate(Fmu.open(path), 1.0)
    with zipfile.ZipFile(path, "a") as file:
        file.writestr("binaries/riscv64-linux/block_on_belt.so", "")
    with pytest.raises(StickslipError, match="it has riscv64-linux"):
        simulate(Fmu.open(path), 1.0)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_missing_binary_is_built_from_the_sources(tmp_path: Path, version: str) -> None:
    path = repacked(tmp_path / "a.fmu", version, "(?!binaries)")
    assert {Path(name).suffix for name in sources(Fmu.open(path))} == {".c"}  # and not its headers
    run, packed = (simulate(Fmu.open(p), 5.0) for p in (path, built("block_on_belt", fmi_version=version)))
    assert np.array_equal(run["x"], packed["x"])


BUILD = """<fmiBuildDescription fmiVersion="3.0"><BuildConfiguration modelIdentifier="block_on_belt">
<SourceFileSet language="{}"><SourceFile name="{}"/><PreprocessorDefinition name="{}" value="1"/></SourceFileSet>
</BuildConfiguration></fmiBuildDescription>"""


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"all": "int main(void) { return nonsense; }"}, "cannot be built.*nonsense"),
        ({"buildDescription": BUILD.format("C11", "../../secret.c", "A")}, "'../../secret.c', which lies outside"),
        ({"buildDescription": BUILD.format("C11", "/etc/passwd", "A")}, "'/etc/passwd', which lies outside"),
        ({"buildDescription": BUILD.format("C11", "-o", "A")}, "'-o', which lies outside"),
        ({"buildDescription": BUILD.format("C11", "other.c", "A")}, "'other.c', which is not there"),
        ({"buildDescription": BUILD.format("C11", "all.c", "A -o /evil")}, "ill-formed macro"),
        ({"buildDescription": BUILD.format("Fortran", "all.c", "A")}, "written in Fortran"),
    ],
)
def test_sources_that_cannot_be_built(tmp_path: Path, changed: dict[str, str], said: str) -> None:
    path = repacked(tmp_path / "a.fmu", "3.0", "(?!binaries)", **changed)
    with pytest.raises(StickslipError, match=f"(?s){said}"):
        simulate(Fmu.open(path), 1.0)


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_rigid_contact_is_known_by_its_type_whatever_its_description_says(version: str, tmp_path: Path) -> None:
    path = tmp_path / "ball.fmu"
    with zipfile.ZipFile(built("bouncing_ball", fmi_version=version)) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            data = source.read(name)
            if name == "modelDescription.xml":
                data, replaced = re.subn(rb'(name="\w+_state"[^>]* description=)"[^"]*"', rb'\1"somewhere"', data)
                assert replaced == len(Fmu.open(built("bouncing_ball")).contacts)
            target.writestr(name, data)
    fmu = Fmu.open(path)
    assert fmu.impacts == fmu.contacts == ["table"]
    assert Fmu.open(built("block_on_belt", fmi_version=version)).impacts == []
