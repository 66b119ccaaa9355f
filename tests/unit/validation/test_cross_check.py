"""Random cases: the same from the same seed, repeated by their command line, and an engine with a fault is found."""

from __future__ import annotations

import json
import re
import shlex
import zipfile
from pathlib import Path

import numpy as np
import pytest
from quick_export import QUICK
from typer.testing import CliRunner
from whole_application import app

from fmu_models import oscillators
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.toolchain.compiler import compile_shared, engine_sources
from fmu_models.toolchain.platforms import this_platform
from fmu_models.validation.stress import cross_check as second_path
from fmu_models.validation.stress.cross_check import SecondPath, cross_check
from fmu_models.validation.stress.judge import StressCell, StressSubject
from fmu_models.validation.stress.random_cases import command_line
from fmu_models.validation.stress.trial import Trial
from fmu_models.validation.stress.workers import drawn

# file, what stands there, what is to stand there, and a model that shows it
FAULTS = {
    "restitution": (
        "step/contact_forces.c",
        "target[c] = -model_restitution(at->p, at->d, c)",
        "target[c] = -1.00001 * model_restitution(at->p, at->d, c)",
        "impact_pair",
    ),
    "side of the slip": (
        "events/contact_placement.c",
        "slip[c][0] < 0.0 ? CONTACT_SLIP_MINUS : CONTACT_SLIP_PLUS",
        "slip[c][0] > 0.0 ? CONTACT_SLIP_MINUS : CONTACT_SLIP_PLUS",
        "disc_rig",
    ),
    "late events": (
        "step/event_location.c",
        "    h = first;\n",
        "    h = first < h ? first * (1.0 + 1e-7) : first;\n",
        "discontinuous_support",
    ),
}


def with_fault(path: Path, file: str, old: str, new: str, folder: Path) -> Fmu:
    """The FMU at ``path`` with another engine in it."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    source = f"sources/{file}"
    text = files[source].decode()
    assert text.count(old) == 1
    files[source] = text.replace(old, new).encode()
    (binary,) = (name for name in files if name.startswith("binaries/"))
    c_files = {n.removeprefix("sources/"): t for n, t in files.items() if n.endswith((".c", ".h"))}
    files[binary] = compile_shared(c_files, folder / f"library{this_platform().suffix}", options=QUICK).read_bytes()
    target = folder / path.name
    with zipfile.ZipFile(target, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return Fmu.open(target)


def cells(model: str, fmu: Fmu, count: int) -> list[StressCell]:
    second = SecondPath(StressSubject.of(oscillators.load(model), fmu))
    return [cross_check(case, second) for case in drawn(model, count, 1)]


@pytest.mark.nightly_for("restitution", "side of the slip")
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_the_engine_is_found(fault: str, tmp_path: Path) -> None:
    file, old, new, model = FAULTS[fault]
    spoilt = cells(model, with_fault(built(model), file, old, new, tmp_path), 8)
    found = [cell for cell in spoilt if cell.verdict == "failed"]
    assert found, [cell.message for cell in spoilt]
    assert all(cell.message and cell.check for cell in found)
    # it is the fault that was found
    assert {cell.verdict for cell in cells(model, Fmu.open(built(model)), 8)} == {"accurate"}


def test_the_same_seed_gives_the_same_cases() -> None:
    first = drawn("woodpecker", 5, 3)
    assert drawn("woodpecker", 8, 3)[:5] == first
    assert drawn("woodpecker", 5, 4) != first
    assert len({command_line(case) for case in first}) == 5


def test_a_command_line_repeats_a_case_to_the_last_bit(tmp_path: Path) -> None:
    case = drawn("forced_stick_slip", 3, 1)[2]
    run = Trial(Fmu.open(built(case.model)), case, case.duration).run()
    program, *arguments = shlex.split(command_line(case))
    assert program == "stickslip"
    done = CliRunner().invoke(app, [*arguments, "--json", "-o", str(tmp_path / "run.csv")])
    assert done.exit_code == 0, done.output
    ranges = json.loads(done.stdout)["ranges"]
    for name in Fmu.open(built(case.model)).states:
        assert ranges[name]["end"] == run[name][-1]


def test_events_of_the_second_path_are_shifted_by_what_is_allowed_for() -> None:
    (stated,) = re.findall(r"\.importer = (\S+),", engine_sources()["model/run_state.c"])
    assert float(stated) == second_path.SHIFT


def test_a_case_that_is_sensitive_is_compared_as_long_as_anything_is_known() -> None:
    found = cells("bouncing_ball", Fmu.open(built("bouncing_ball")), 30)
    assert {cell.verdict for cell in found} == {"accurate"}
    # bounces that accumulate: neither path knows how it goes on
    assert min(cell.reached for cell in found) < 1.0
    assert np.mean([cell.reached for cell in found]) > 0.8
