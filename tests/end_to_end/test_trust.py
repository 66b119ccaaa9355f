"""Reading data runs no code: a document that names a Python file is refused unless the user trusts it."""

from __future__ import annotations

import ast
import json
import re
import shutil
import sys
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_type_hints

import pytest
from made_fit import made_fit

from fmu_models import load, oscillators, read_scene, read_system
from fmu_models.base import trust
from fmu_models.base.errors import StickslipError
from fmu_models.base.registry import Registry
from fmu_models.explorer.page import explore
from fmu_models.language.laws import LAWS
from identification import read_calibration, read_fit, read_machine_fit
from identification.calibration.result import calibrated_fmu
from identification.commands import application
from identification.estimators import ESTIMATORS
from identification.fit.result import FrictionFit
from identification.laws import find_law
from identification.machines.read import machine_of
from identification.watch.state import WatchState, read_state

ROOT = Path(__file__).parents[2]
RIGS = ROOT / "data" / "rigs" / "paper_rubber"
SCENE = """title = "of somebody else"
model = "{model}"
stop_time = "1 s"
[laws]
belt = "{law}"
[compute]
kind = "{kind}"
"""
MACHINE_FIT = {
    **dict.fromkeys(("title", "source", "method"), "theirs"),
    **dict.fromkeys(("joints", "parameters", "silent", "logs", "verdicts"), ()),
    **dict.fromkeys(("condition", "raw_condition", "neighbour_correlation", "effective_samples"), 1.0),
    **{"machine": "arm", "known": {}, "cutoff": None, "parallel_cutoff": None, "samples": 1, "rounds": 1},
}

CALIBRATION = {
    **dict.fromkeys(("model", "title", "method"), "theirs"),
    **dict.fromkeys(("logs", "parameters", "starts", "covariance", "directions", "residuals", "minima"), ()),
    **{"type": "stickslip calibration", "freedom": 1, "inflation": 1.0},
    "collinearity": {"index": 1.0, "direction": {}, "percent": {}},
}


def scene(**names: str) -> str:
    return SCENE.format(**{"model": "block_on_belt", "law": "coulomb", "kind": "trajectory", **names})


@dataclass(frozen=True)
class Case:
    """A kind of document, at one place where it names code.

    text: of the document, from a reference; command: that reads it, FILE standing for it; use: it is read in Python and
    what it names is loaded; name: of the file; quick: the command gets to the code within a second.
    """

    text: Callable[[str], str]
    command: tuple[str, ...]
    use: Callable[..., object]
    name: str = "document.json"
    quick: bool = True


CASES = {
    "fit, law": Case(
        lambda code: replace(made_fit(), declaration=code).to_json(),
        ("apply", "FILE", "-o", "rig.ssv"),
        lambda path, **how: find_law(read_fit(path, **how).law_reference),
    ),
    "fit, estimator": Case(
        lambda code: replace(made_fit(), estimator=code).to_json(),
        ("report", "FILE", str(RIGS)),
        lambda path, **how: ESTIMATORS.load(read_fit(path, **how).estimator),
        quick=False,
    ),
    "fit as text": Case(
        lambda code: replace(made_fit(), declaration=code).to_json(),
        ("compare", "FILE", str(RIGS)),
        lambda path, **how: find_law(FrictionFit.from_json(path.read_text(), **how).law_reference),
    ),
    "fit of a machine": Case(
        lambda code: json.dumps({**MACHINE_FIT, "declaration": code}),
        ("report", "FILE", str(RIGS)),
        lambda path, **how: machine_of(read_machine_fit(path), **how),
    ),
    "calibration": Case(
        lambda code: json.dumps({**CALIBRATION, "declaration": code}),
        ("apply", "FILE", "-o", "model.ssv"),
        lambda path, **how: calibrated_fmu(read_calibration(path), **how),
    ),
    "calibration, beside logs": Case(
        lambda code: json.dumps({**CALIBRATION, "declaration": code}),
        ("compare", "FILE", str(RIGS)),
        lambda path, **how: calibrated_fmu(read_calibration(path), **how),
    ),
    "calibration, next experiment": Case(
        lambda code: json.dumps({**CALIBRATION, "declaration": code}),
        ("design", "FILE", "--try", "f=1,2"),
        lambda path, **how: calibrated_fmu(read_calibration(path), **how),
    ),
    "calibration, page": Case(
        lambda code: json.dumps({**CALIBRATION, "declaration": code}),
        ("report", "FILE", str(RIGS)),
        lambda path, **how: calibrated_fmu(read_calibration(path), **how),
    ),
    "scene, model": Case(lambda code: scene(model=code), ("scene", "FILE"), read_scene, "document.toml"),
    "scene, law": Case(lambda code: scene(law=code), ("simulate", "FILE"), read_scene, "document.toml"),
    "scene, kind": Case(lambda code: scene(kind=code), ("basins", "FILE"), explore, "document.toml"),
    "scene of a bench": Case(lambda code: scene(model=code), ("emulate", "FILE", "out"), read_scene, "document.toml"),
    "scene to export": Case(lambda code: scene(model=code), ("export", "FILE"), read_scene, "document.toml"),
    "scene to explore": Case(lambda code: scene(model=code), ("explore", "FILE"), explore, "document.toml"),
    "scene to measure": Case(lambda code: scene(model=code), ("bench", "FILE"), read_scene, "document.toml"),
    "scene of a branch": Case(lambda code: scene(model=code), ("branch", "FILE"), read_scene, "document.toml"),
    "system": Case(
        lambda code: f'stop_time = 1.0\n[units.one]\nmodel = "{code}"\n',
        ("couple", "FILE"),
        read_system,
        "document.toml",
    ),
    "system that is calibrated": Case(
        lambda code: f'stop_time = 1.0\n[units.one]\nmodel = "{code}"\n',
        ("calibrate", "FILE", "FILE", "--free", "one.k"),
        lambda path, **how: read_system(path, **how),
        "document.toml",
    ),
    "state of a watch, law": Case(
        lambda code: json.dumps(WatchState(code, "shooting").to_dict()),
        ("watch", str(RIGS), "--once", "--state", "FILE"),
        lambda path, **how: find_law(read_state(path, **how).law),
        quick=False,
    ),
    "state of a watch, estimator": Case(
        lambda code: json.dumps(WatchState("Conti", code).to_dict()),
        ("watch", str(RIGS), "--once", "--state", "FILE"),
        lambda path, **how: ESTIMATORS.load(read_state(path, **how).estimator),
        quick=False,
    ),
}


@pytest.fixture
def marker(tmp_path: Path) -> Path:
    """What `evil.py`, in the working folder, leaves behind when it runs."""
    (tmp_path / "evil.py").write_text(f"open({str(tmp_path / 'marker')!r}, 'w').close()\n")
    return tmp_path / "marker"


@pytest.fixture
def fresh(monkeypatch):
    """What a process trusts that has just begun; called again, the next process."""

    def begin() -> None:
        monkeypatch.setattr(trust, "_process", trust._Process())

    begin()
    return begin


@pytest.mark.parametrize("kind", CASES)
def test_a_document_runs_no_code_unless_it_is_trusted(stickslip, marker, fresh, tmp_path, kind):
    case, path = CASES[kind], tmp_path / CASES[kind].name
    command = [path.name if part == "FILE" else part for part in case.command]
    for code in ("evil.py", "evil.py:NAME", "evil:NAME", str(tmp_path / "evil.py"), f"../{tmp_path.name}/evil.py"):
        path.write_text(case.text(code))
        refused = stickslip(*command)
        assert refused.code == 2 and not marker.exists(), code
        for said in (path.name, f"'{code}'", f"\n  stickslip {' '.join(command)} --trust\n"):
            assert said in refused.err, refused.err
        with pytest.raises(StickslipError, match=r"reading data runs no code\..* say trust=True"):
            case.use(path)
        assert not marker.exists(), code
        if case.quick and code in ("evil.py", "evil:NAME"):
            assert "reading data" not in stickslip(*command, "--trust").err and marker.exists()
            marker.unlink()
            assert "reading data" in stickslip(*command).err  # a run does not trust for the next one
        with pytest.raises(StickslipError, match="defines no"):  # what is evil is no law or model beside
            case.use(path, trust=True)
        assert marker.exists(), code
        marker.unlink()
        fresh()


def test_what_the_command_line_names_is_trusted(stickslip, marker, fresh, tmp_path):
    """The very file, however it is written; not another one of that name."""
    (tmp_path / "fit.json").write_text(CASES["fit of a machine"].text("evil.py"))
    assert "reading data" in stickslip("report", "fit.json", RIGS).err and not marker.exists()
    assert "reading data" not in stickslip("report", "fit.json", RIGS, "--machine", "evil.py").err and marker.exists()
    marker.unlink()
    state = tmp_path / "watch.json"
    state.write_text(json.dumps(WatchState(str(tmp_path / "evil.py"), "shooting").to_dict()))
    (tmp_path / "other").mkdir()
    shutil.copy(tmp_path / "evil.py", tmp_path / "other")
    watch = ("watch", tmp_path / "other", "--once", "--state", state)
    assert "reading data" in stickslip(*watch, "--law", "other/evil.py").err
    assert "reading data" not in stickslip(*watch, "--law", "./evil.py").err
    assert "reading data" not in stickslip(*watch, "--law=other/../evil.py").err


def test_what_a_program_has_named_is_trusted(marker, fresh, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = CASES["fit, law"].text(str(tmp_path / "evil.py"))
    (tmp_path / "fit.json").write_text(text)
    for read, source in (
        (read_fit, "fit.json"),
        (FrictionFit.from_json, text),
        (FrictionFit.from_dict, json.loads(text)),
    ):
        with pytest.raises(StickslipError, match="reading data runs no code"):
            read(source)
    with pytest.raises(StickslipError, match="defines no LAW"):
        find_law("evil.py")
    assert read_fit("fit.json").law_reference == str(tmp_path / "evil.py")


def test_members_and_what_comes_along_need_no_trust(stickslip, fresh, tmp_path):
    (tmp_path / "scene.toml").write_text(scene())
    assert stickslip("scene", "scene.toml").code == 0
    arm = ROOT / "data" / "machines" / "two_link_arm.py"
    (tmp_path / "fit.json").write_text(CASES["fit of a machine"].text(str(arm)))
    assert machine_of(read_machine_fit(tmp_path / "fit.json")).mechanism.name == "two_link_arm"


def test_a_command_runs_no_place_of_which_no_reader_has_thought(marker, fresh, tmp_path):
    """A new kind of document, whose reader forgets to ask: the registry refuses."""
    for line in (["scene", "new.document"], ["scene", "evil_too.py"]):
        with trust.command_line(line), pytest.raises(StickslipError, match="the command line does not name"):
            LAWS.load("evil.py", tmp_path)
        with trust.command_line(line), pytest.raises(StickslipError, match="the command line does not name"):
            LAWS.running("evil:NAME", tmp_path)
    assert not marker.exists()


def test_trusted_code_may_load_what_it_likes(fresh, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "belt.py").write_text("from fmu_models import oscillators\nMODEL = oscillators.load('block_on_belt')\n")
    (tmp_path / "mine.py").write_text("from fmu_models import oscillators\nMODEL = oscillators.load('belt.py')\n")
    with trust.command_line(["simulate", "mine.py"]):
        assert oscillators.load("mine.py").name == "block_on_belt"


def test_no_file_beside_stands_in_for_an_installed_package(marker, fresh, tmp_path, monkeypatch):
    """A scene that names an entry point, with modules of that package's names beside it."""
    site = tmp_path / "site"
    information = site / "theirs-1.dist-info"
    information.mkdir(parents=True)
    (site / "theirs_numbers.py").write_text("import theirs_helper\nNUMBER = 5\n")
    (site / "theirs_helper.py").write_text("")
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1\n")
    (information / "entry_points.txt").write_text("[stickslip.tests]\nfive = theirs_numbers:NUMBER\n")
    for name in ("theirs_numbers.py", "theirs_helper.py"):
        shutil.copy(tmp_path / "evil.py", tmp_path / name)
    monkeypatch.setattr(sys, "path", [*sys.path, str(site)])
    monkeypatch.chdir(tmp_path)
    numbers = Registry[int](kind="number", package="fmu_models.maps", attribute="NUMBER", group="stickslip.tests")
    assert numbers.load("five", tmp_path) == numbers.load("five") == 5
    with numbers.running("five", tmp_path):
        assert str(tmp_path) not in sys.path
    assert not marker.exists()


def test_an_fmu_of_a_system_lies_in_its_folder(stickslip, fresh, tmp_path):
    """An FMU beside or below is part of what the user has asked to run; one elsewhere is not."""
    (tmp_path / "system" / "parts").mkdir(parents=True)
    for place in ("system/parts/block.fmu", "block.fmu"):
        shutil.copy(load("block_on_belt").path, tmp_path / place)
    file = tmp_path / "system" / "s.toml"
    for fmu, inside in (("parts/block.fmu", True), ("../block.fmu", False), (str(tmp_path / "block.fmu"), False)):
        file.write_text(f'stop_time = 0.1\n[units.one]\nfmu = "{fmu}"\n')
        answer = stickslip("couple", file, "--json")
        assert answer.code == (0 if inside else 2), answer.err
        if not inside:
            assert f"names the FMU '{fmu}', which is outside its folder" in answer.err
            with pytest.raises(StickslipError, match="outside its folder"):
                read_system(file)
        assert stickslip("couple", file, "--trust", "--json").code == 0
        assert read_system(file, trust=True).units
        fresh()


def test_every_command_that_reads_such_documents_has_the_option():
    words = (".toml", "SCENE", "Result of 'stickslip fit", "What is known, to go on with")
    without = {"slips", "inverse", "excite", "describe"}  # recipes and answers name no code
    for name in application.COMMANDS.keys() - set(application.GROUPS):
        callback = application.command_of(name)
        hints = get_type_hints(callback, include_extras=True)
        said = [f"{one.metavar} {one.help}" for hint in hints.values() for one in getattr(hint, "__metadata__", ())]
        if name not in without:
            assert ("trust" in hints) == any(word in text for word in words for text in said), name


# what parses files or texts of others, and why nothing in them runs; one that names code belongs among the cases above
PARSERS = {
    "identification/calibration/result.py": "numbers and words; its declaration goes through the door: cases",
    "fmu_models/continuation/kept.py": "nodes of a store: numbers, and classes of a list",
    "fmu_models/families/store.py": "what a store was made of is compared; Zarr of version 3 has no codec of objects",
    "fmu_models/analyses/shares.py": "what a store has of each value: numbers and words",
    "fmu_models/fmu/fmi1.py": "an FMU's own words, after the look at its elements",
    "fmu_models/fmu/fmu.py": "an FMU's own words; periods of signals: formulas that Formula reads, as of a scene",
    "fmu_models/base/job_server.py": "what this program sends to its own child",
    "fmu_models/base/processes.py": "what its own child sends back",
    "fmu_models/base/toml_document.py": "code is named by Document.reference alone: cases",
    "fmu_models/base/plain_values.py": "numbers and texts",
    "fmu_models/base/figures.py": "names and numbers of the axes of a picture, which a form shows",
    "fmu_models/base/unit_names.py": "our own cache",
    "fmu_models/commands/families.py": "start values: numbers by name",
    "fmu_models/commands/data.py": "titles of what comes along",
    "fmu_models/commands/listing.py": "our own cache",
    "fmu_models/commands/scene.py": "scenes that come along",
    "fmu_models/coupling/ssp_documents.py": "names FMUs in its own folder, and no Python",
    "fmu_models/coupling/toml_system.py": "cases",
    "fmu_models/scene/read.py": "cases",
    "fmu_models/scene/scene.py": "our own cache, of scenes that name members alone",
    "fmu_models/language/matrices.py": "arrays of numbers; np.load takes no objects",
    "fmu_models/simulation/results.py": "numbers and texts; kinds of events are those of a list",
    "rig_io/description/answers.py": "roles, units and numbers",
    "rig_io/logs/guarded.py": "columns of numbers from its own child",
    "rig_io/logs/mat_file.py": "arrays of numbers; np.load takes no objects",
    "rig_io/packages/sidecar.py": "roles, units and numbers; the reader is named on the command line alone",
    "rig_io/readers/hdf5_log.py": "arrays of numbers",
    "identification/fit/result.py": "cases",
    "identification/machines/machine_fit.py": "cases",
    "identification/machines/urdf.py": "numbers and names",
    "identification/measurement/recipe.py": "its laws are those that come along",
    "identification/transfer/scene.py": "cases: by checked_scene",
    "identification/studio/forms.py": "whether a file has a table of units",
    "identification/studio/steps.py": "what the studio wrote of its own steps",
    "identification/studio/study.py": "cases in test_studio.py: commands of ours, which name nothing untrusted",
    "identification/watch/state.py": "cases",
}
# what runs code that it is told: one door for Python; the others run what is ours, or an FMU that the user has named
RUNNERS = {
    "fmu_models/base/registry.py": "the door",
    "fmu_models/base/exports.py": "our own modules",
    "fmu_models/base/child_process.py": "our own module",
    "fmu_models/base/console.py": "the C library of this process",
    "fmu_models/codegen/law_functions.py": "text that SymPy has printed of a law that the door has let in",
    "fmu_models/fmu/library.py": "the C library of this process",
    "fmu_models/importer/instance.py": "an FMU that the user has named",
    "fmu_models/lanes/library.py": "our engine, compiled with an FMU of ours",
    "fmu_models/simulation/engine.py": "an FMU that the user has named",
    "identification/studio/study.py": "our own commands",
    "fmu_models/report/manual.py": "Sphinx",
    "fmu_models/toolchain/compiler.py": "the compiler",
    "identification/commands/application.py": "our own modules",
    "fmu_models/validation/methods/peers/heyoka_taylor.py": "an installed package",
}
PARSING = {
    "read_document",
    "Document",
    "from_plain",
    "fromstring",
    "open_group",
    "open_zarr",
    "open_dataset",
    "loadmat",
}
PARSING |= {"Unpickler", "iterparse", "fromfile", "safe_load", "ElementTree.parse", "tomlkit.parse", "h5py.File"}
PARSING |= {f"{module}.{name}" for module in ("json", "tomllib", "pickle", "np", "yaml") for name in ("load", "loads")}
RUNNING = {"exec", "eval", "import_module", "__import__", "spec_from_file_location", "run_path", "run_module", "CDLL"}
RUNNING |= {"LoadLibrary", "Popen", "subprocess.run", "os.system"}


def test_nothing_else_parses_files_or_runs_what_it_is_told():
    parses, runs = set(), set()
    for path in (path for top in ("fmu_models", "rig_io", "identification") for path in (ROOT / top).rglob("*.py")):
        file = path.relative_to(ROOT).as_posix()
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Call):
                called = ast.unparse(node.func)
                names = {called, called.rpartition(".")[2]}
                parses |= {file} if names & PARSING else set()
                runs |= {file} if names & RUNNING else set()
    assert parses == set(PARSERS)
    assert runs == set(RUNNERS)


EVIL = "\x1b[2J\u202e\x9b31m"


def test_foreign_texts_are_no_commands_to_the_terminal(stickslip, fresh, tmp_path):
    """Of a scene, of an FMU and of a log, printed, as JSON and in errors."""
    (tmp_path / "scene.toml").write_text(
        scene().replace("somebody else", json.dumps(EVIL)[1:-1].replace("\x9b", "\\u009b") + "[/bold]")
    )
    (tmp_path / "log.csv").write_text(f"time [s],las{EVIL}er [m]\n" + "".join(f"{i},{i}\n" for i in range(50)))
    with zipfile.ZipFile(load("block_on_belt").path) as ours, zipfile.ZipFile(tmp_path / "evil.fmu", "w") as theirs:
        for entry in ours.infolist():
            text = ours.read(entry)
            if entry.filename == "modelDescription.xml":
                text = re.sub(rb'description="[^"]*"', f'description="{EVIL[4:]}"'.encode(), text)
            theirs.writestr(entry, text)
    for command in (
        ("scene", "scene.toml"),
        ("simulate", "scene.toml"),
        ("inspect", "evil.fmu"),
        ("simulate", "evil.fmu", "--until", "1", "--set", f"{EVIL}=1"),
        ("describe", "log.csv"),
        ("fit", "log.csv"),
        ("scene", f"{EVIL}.toml"),
        ("scene", "scene.toml", f"--{EVIL}"),
    ):
        for json_too in ((), ("--json",)):
            answer = stickslip(*command, *json_too)
            assert not set("\x1b\u202e\x9b\r") & set(answer.out + answer.err), command
            if json_too and answer.code == 0:
                assert answer.json
    assert stickslip("scene", "scene.toml", "--json").json["scene"]["title"] == f"of {EVIL}[/bold]"
    assert r"of \x1b[2J\u202e\x9b31m[/bold]" in stickslip("scene", "scene.toml").out
