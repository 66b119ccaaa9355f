"""Independent checkers find nothing to say about an exported FMU."""

from __future__ import annotations

import logging
import shutil
from pathlib import Path

import pytest
from fmpy.validation import validate_fmu
from some_nightly import some_nightly

from fmu_models import oscillators
from fmu_models.codegen.package import FMI_VERSIONS

CASES = [(model, version) for model in oscillators.names() for version in FMI_VERSIONS]
# friction, impacts, stops of Hertz, switched flows: each kind of generated C
COMPILED = (("disc_rig", "2.0"), ("woodpecker", "3.0"), ("hinge_clearance", "3.0"), ("planar_hopf", "3.0"))
# friction, impacts, laws that are no analytic function where contact begins
FACES = ("disc_rig", "woodpecker", "hinge_clearance")


@pytest.mark.nightly_for("planar_multiple_crossing-fmi3", "drive_motor-fmi3", "two_domain_oscillator-fmi3")
def test_fmpy_finds_no_problem(path: Path) -> None:
    assert validate_fmu(str(path)) == []


def test_fmu_manipulation_toolbox_finds_no_problem(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    from fmu_manipulation_toolbox.checker import get_checkers
    from fmu_manipulation_toolbox.operations import FMU

    logger = logging.getLogger("fmu_manipulation_toolbox")
    logger.addHandler(caplog.handler)
    try:
        with caplog.at_level(logging.INFO), FMU(str(path)) as checked:
            for checker in get_checkers():
                checked.apply_operation(checker())
    finally:
        logger.removeHandler(caplog.handler)
    said = [(record.levelname, record.getMessage()) for record in caplog.records]
    assert [message for level, message in said if level != "INFO"] == []
    assert any("compliant" in message for _, message in said)
    assert any("No semantic error" in message for _, message in said)


@pytest.mark.parametrize("case", some_nightly(CASES, COMPILED), ids="-fmi".join, indirect=True)
def test_importers_that_compile_can(case: tuple[str, str], path: Path, tmp_path: Path) -> None:
    from fmpy import extract, platform, platform_tuple, simulate_fmu
    from fmpy.build import build_platform_binary

    if case[1] == "2.0" and case[0] not in FACES:
        pytest.skip("its sources differ from those of FMI 3 in the face alone, which other models have too")
    if shutil.which("cmake") is None or shutil.which("cc") is None:
        pytest.skip("needs cmake and a C compiler of the system")
    folder = Path(extract(str(path), unzipdir=str(tmp_path / "fmu")))
    shipped = sorted((folder / "binaries").rglob("*.*"))
    shutil.rmtree(folder / "binaries")
    (tmp_path / "build").mkdir()
    # one is optimised, as test_source_builds has another; what else there is must compile, in a third of the time
    configuration = "Release" if case == COMPILED[0] else "Debug"
    build_platform_binary(folder, tmp_path / "build", configuration=configuration, all_warnings=True)
    compiled = sorted((folder / "binaries").rglob("*.*"))
    assert compiled == shipped, (platform, platform_tuple)
    result = simulate_fmu(str(folder), stop_time=1.0)
    assert result["time"][-1] == pytest.approx(1.0)
