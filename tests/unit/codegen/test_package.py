"""Export: the archive, its name and its place."""

from __future__ import annotations

import re
import subprocess
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from quick_export import quick_export

from fmu_models.base.errors import StickslipError
from fmu_models.codegen import package
from fmu_models.codegen.package import built, export, variant
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation.run import simulate
from fmu_models.simulation.sensitivity import flow_derivative
from fmu_models.toolchain.platforms import this_platform


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_the_same_mechanism_gives_the_same_bytes(tmp_path: Path, version: str) -> None:
    one = export(variant("block_on_belt"), tmp_path / "one.fmu", fmi_version=version)
    other = export(variant("block_on_belt"), tmp_path / "other.fmu", fmi_version=version)
    assert one.read_bytes() == other.read_bytes()


def test_what_the_archive_holds() -> None:
    path = built("block_on_belt")
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        text = archive.read("sources/all.c").decode()
        build = ElementTree.fromstring(archive.read("sources/buildDescription.xml"))
    platform, _, _, suffix = this_platform()
    assert {"modelDescription.xml", "documentation/index.html"} < names
    assert f"binaries/{platform}/block_on_belt{suffix}" in names
    included = set(re.findall(r'#include "(\S+)"', text))
    assert {f"sources/{name}" for name in included} < names
    assert "fmi/fmi3.c" in included and "sources/fmi/fmi2.c" not in names
    assert [file.get("name") for file in build.iter("SourceFile")] == ["all.c"]
    assert [d.get("name") for d in build.iter("PreprocessorDefinition")] == ["FMI3_OVERRIDE_FUNCTION_PREFIX"]


def test_headers_of_the_standard_are_not_vendored() -> None:
    with zipfile.ZipFile(built("block_on_belt")) as archive:
        assert not [name for name in archive.namelist() if re.search(r"fmi[23](Functions|PlatformTypes)", name)]


def test_a_file_that_exists_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "model.fmu"
    path.write_text("precious")
    for write in (export, lambda name, path: export(variant(name), path)):
        with pytest.raises(StickslipError, match="exists already"):
            write("block_on_belt", path)
    assert path.read_text() == "precious"
    export("block_on_belt", path, overwrite=True)
    assert zipfile.is_zipfile(path)
    assert list(tmp_path.iterdir()) == [path]


def test_names_and_versions_are_checked(tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match=r"2\.0 or 3\.0"):
        export("block_on_belt", tmp_path / "a.fmu", fmi_version="1.0")
    with pytest.raises(StickslipError, match=r"must end in \.fmu"):
        export("block_on_belt", tmp_path / "a.zip")
    with pytest.raises(StickslipError, match="Did you mean 'disc_rig'"):
        built("disc_rigg")
    with pytest.raises(StickslipError, match="no contact 'disk0'"):
        built("disc_rig", contacts=["disk0"])
    with pytest.raises(StickslipError, match="no contact 'disk0'"):
        built("disc_rig", laws={"disk0": "lugre"})
    with pytest.raises(StickslipError, match="Did you mean 'lugre'"):
        built("disc_rig", laws={"disc0": "lugree"})
    with pytest.raises(StickslipError, match="around another"):
        built("disc_rig", laws={"disc0": "kelvin_voigt"})
    with pytest.raises(StickslipError, match="cannot be written"):
        export("block_on_belt", "/proc/no/such/place.fmu")
    assert not list(tmp_path.iterdir())


def test_contacts_and_laws_choose_the_variant() -> None:
    whole, one, bristles = (
        Fmu.open(built("disc_rig", contacts=contacts, laws=laws))
        for contacts, laws in ((None, None), (["disc0"], None), (["disc0"], {"disc0": "lugre"}))
    )
    assert whole.contacts == ["disc0", "disc1"]
    assert one.contacts == ["disc0"] and "N1" not in one.parameters and one.inputs == ["w0"]
    assert {"sigma00", "sigma10"} <= set(bristles.parameters) and len(bristles.states) == 3
    names = {fmu.description.modelName for fmu in (whole, one, bristles)}
    assert len(names) == 3
    assert Fmu.open(built("disc_rig", contacts=[])).contacts == []


@pytest.mark.parametrize(("name", "until"), [("disc_rig", 20.0), ("woodpecker", 2.0), ("two_domain_oscillator", 20.0)])
def test_optimization_leaves_every_bit_of_a_run(tmp_path: Path, name: str, until: float) -> None:
    """Dry friction, rigid contacts, switches: no operation is fused or put in another order."""
    runs, derivatives = [], []
    for path in (built(name), quick_export(variant(name), tmp_path / f"{name}.fmu")):
        fmu = Fmu.open(path)
        run = simulate(fmu, until)
        runs.append([run[column] for column in (*fmu.states, *fmu.outputs)])
        derivatives.append(flow_derivative(fmu, until / 10).by_start)
    assert np.array_equal(runs[0], runs[1]) and np.array_equal(derivatives[0], derivatives[1])
    assert built(name).stat().st_size != path.stat().st_size


def test_the_order_of_contacts_does_not_matter() -> None:
    assert built("disc_rig", contacts=["disc1", "disc0"]) == built("disc_rig", contacts=["disc0", "disc1"])


def test_a_change_of_the_engine_makes_a_new_fmu(monkeypatch: pytest.MonkeyPatch) -> None:
    before = package._sources_digest()
    monkeypatch.setattr(package, "version", lambda: "another")
    assert package._sources_digest() != before


def test_a_warm_export_compiles_nothing_and_does_no_symbolic_work(tmp_path: Path) -> None:
    built("disc_rig")
    code = (
        "import os, sys; sys.addaudithook(lambda event, _: os._exit(3) if event == 'subprocess.Popen' else None); "
        "from fmu_models.codegen.package import export; "
        f"export('disc_rig', {str(tmp_path / 'a.fmu')!r}); "
        "sys.exit('sympy' in sys.modules or 'pint' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_engine_allocates_for_instances_fmu_states_and_derivatives_alone() -> None:
    with zipfile.ZipFile(built("disc_rig")) as archive:
        sources = {name: archive.read(name).decode() for name in archive.namelist() if name.endswith((".c", ".h"))}
    allocating = {name for name, text in sources.items() if re.search(r"\b(malloc|calloc|realloc|alloca)\s*\(", text)}
    # variables: rows of derivatives while one is asked for
    assert allocating == {"sources/fmi/instance.c", "sources/fmi/fmu_state.c", "sources/fmi/variables.c"}
