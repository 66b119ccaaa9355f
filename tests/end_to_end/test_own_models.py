"""A model, a law and a reader in a folder of the user's, and those of an installed package, through every command."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from rig_io.packages.datapackage import read_package

ROOT = Path(__file__).parents[2]
RIGS = ROOT / "data" / "rigs" / "paper_rubber"
READER = """
import numpy as np
from rig_io.logs.table import Reader, Table

def read(path):
    lines = path.read_text().splitlines()
    assert lines[0] == "my recorder", "not of my recorder"
    names = lines[1].split()
    values = np.array([[float(cell) for cell in line.split()] for line in lines[2:]])
    return Table(f"'{path}'", dict(zip(names, values.T)))

READER = Reader((".rec",), read)
"""


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """The folder of a user with a model of his own, whose constants stand in a module beside it."""
    text = (ROOT / "fmu_models" / "oscillators" / "block_on_belt.py").read_text()
    text = text.replace('name="block_on_belt"', 'name="own_block"').replace('"m", 1.0', '"m", constants.MASS')
    (tmp_path / "my_model.py").write_text(text.replace("from fmu_models", "import constants\nfrom fmu_models", 1))
    (tmp_path / "constants.py").write_text("MASS = 1.0\n")
    return tmp_path


SCENE = """title = "A heavy block"
model = "{model}"
stop_time = "5 s"
[free]
m = "2 kg"
[drives]
v_belt = 0.1
[compute]
kind = "{kind}"
"""


RIG = """title = "The rig under a law of one's own"
model = "disc_rig"
contacts = ["disc0"]
stop_time = "2 s"
[laws]
disc0 = "my_law.py"
[drives]
w0 = 0.41
"""


def test_every_command_takes_a_model_of_ones_own(stickslip, own):
    shipped = stickslip("simulate", "block_on_belt", "--until", "5", "--json").json
    for name in ("my_model.py", "my_model.py:MODEL", "my_model:MODEL", own / "my_model.py"):
        run = stickslip("simulate", name, "--until", "5", "--json", "--figure", "run.png", "--overwrite").json
        assert run["contacts"] == shipped["contacts"] and run["events"] == shipped["events"]
    assert stickslip("show", "my_model.py", "--json").json["name"] == "own_block"
    assert stickslip("export", "my_model.py", "--contacts", "belt", "--fmi", "2.0").code == 0
    assert stickslip("inspect", "own_block_belt.fmu", "--json").json["model"] == "own_block"
    assert stickslip("export", "my_model.py", "--set", "m=3", "-o", "heavy.fmu").code == 0
    cells = stickslip("stress", "my_model.py", "--quick", "--case", "start*", "--json").json
    assert cells["cells"] and not any(cell["verdict"] == "failed" for cell in cells["cells"])
    bench = stickslip("bench", "my_model.py", "--until", "1", "--method", "taylor", "--json")
    assert bench.code == 0 and "own_block" in bench.out


@pytest.mark.nightly
def test_a_result_is_that_of_the_model_as_it_is_now(stickslip, own):
    """Of its file, of the module beside it, and in a scene: twice within one second."""
    (own / "s.toml").write_text(
        SCENE.format(model="my_model.py", kind="trajectory").replace("m = ", "k = ").replace("kg", "N/m")
    )
    found = []
    for mass in (1.0, 2.0, 1.0):
        (own / "constants.py").write_text(f"MASS = {mass}\n")
        run = stickslip("simulate", "my_model.py", "--until", "3", "--json").json
        scene = stickslip("scene", "s.toml", "--trust", "--json").json["results"]
        found.append((run["ranges"], scene))
    assert found[0] == found[2] and found[0][0] != found[1][0] and found[0][1] != found[1][1]


@pytest.mark.nightly
def test_a_scene_finds_the_model_beside_it(stickslip, own, tmp_path_factory, monkeypatch):
    (own / "heavy.toml").write_text(SCENE.format(model="my_model.py", kind="cycle"))
    (own / "module.toml").write_text(SCENE.format(model="my_model:MODEL", kind="cycle"))
    (own / "shipped.toml").write_text(SCENE.format(model="block_on_belt", kind="cycle"))
    answer = stickslip("scene", "heavy.toml", "--explain", "--trust", "--json")
    assert answer.code == 0 and answer.json["explained"]["sizes"]["model"]["contacts"] == 1
    results = stickslip("scene", "shipped.toml", "--json").json["results"]
    assert answer.json["results"] == results
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    for name in ("heavy.toml", "module.toml"):
        assert stickslip("scene", own / name, "--trust", "--json").json["results"] == results
        assert stickslip("simulate", own / name, "--trust", "--json").code == 0
        assert stickslip("export", own / name, "--trust").code == 0
    (own / "system.toml").write_text('stop_time = 1.0\n[units.one]\nmodel = "my_model.py"\n')
    answer = stickslip("couple", own / "system.toml", "--trust", "--json")
    assert answer.code == 0, answer.err


def test_an_error_shows_the_line_of_the_user(stickslip, own):
    (own / "heavy.toml").write_text(SCENE.format(model="my_model.py", kind="cycle"))
    model = own / "my_model.py"
    line = 1 + model.read_text().splitlines().index("    kinetic_energy=m * x.v**2 / 2,")
    for old, new, said in (
        ("x.v**2 / 2", "x.w**2 / 2", "AttributeError: 'Coordinate' object has no attribute 'w'"),
        ("x.v**2 / 2", "x.v / 0", "block_on_belt"),
    ):
        text = model.read_text()
        model.write_text(text.replace(f"m * {old}", f"m * {new}"))
        scene = ("scene", "heavy.toml", "--trust")
        for command, place in ((("simulate", "my_model.py"), ""), (scene, "heavy.toml, line 2: ")):
            answer = stickslip(*command)
            assert answer.code == 2 and answer.err.startswith(f"stickslip: {place}my_model.py, line ")
            assert "Traceback" not in answer.err
            if said.startswith("Attribute"):
                assert f"my_model.py, line {line}: {said}" in answer.err
        model.write_text(text)
    (own / "constants.py").write_text("\nMASS = 1 / 0\n")
    assert "constants.py, line 2: ZeroDivisionError" in stickslip("show", "my_model.py").err
    for name, said in (
        ("my_modle.py", "'my_modle.py' does not exist. Did you mean 'my_model.py'?"),
        ("my_model", "write my_model.py"),
        ("constants.py", "defines no MODEL"),
    ):
        (own / "constants.py").write_text("MASS = 1.0\n")
        assert said in stickslip("simulate", name).err


@pytest.mark.nightly
def test_every_command_takes_a_law_of_ones_own(stickslip, tmp_path):
    stickslip("new", "law", "my_law")
    (tmp_path / "s.toml").write_text(
        SCENE.format(model="block_on_belt", kind="trajectory") + '[laws]\nbelt = "my_law.py"\n[parameters]\nv_s = 0.2\n'
    )
    assert stickslip("scene", "s.toml", "--trust").code == 0
    values = stickslip("scene", "s.toml", "--trust", "--json").json["results"][0]["values"]
    (tmp_path / "my_law.py").write_text((tmp_path / "my_law.py").read_text().replace("** 2)", "** 4)"))
    assert stickslip("scene", "s.toml", "--trust", "--json").json["results"][0]["values"] != values
    fit = ("fit", RIGS, "--law", "my_law.py", "--estimator", "weak-form", "--result", "fit.json")
    assert stickslip(*fit).code == 0
    assert stickslip("compare", "fit.json", RIGS, "--no-uncertainty", "--trust").code == 0
    assert stickslip("report", "fit.json", RIGS, "--no-residuals", "--no-uncertainty", "--trust").code == 0
    assert stickslip("apply", "fit.json", "-o", "rig.fmu", "--trust").code == 0
    assert "v_s0" in stickslip("inspect", "rig.fmu").out
    copied = ("apply", "fit.json", "rig.toml", "--name", "v_s0=v_s0", "-o", "elsewhere/fitted.toml", "--trust")
    (tmp_path / "rig.toml").write_text(RIG)
    assert stickslip(*copied).code == 0 and stickslip("scene", "elsewhere/fitted.toml", "--trust").code == 0
    (tmp_path / "my_law.py").write_text("x = 1\n1 / 0\n")
    for command in (fit, ("scene", "s.toml", "--trust")):
        assert "my_law.py, line 2: ZeroDivisionError" in stickslip(*command, *(["--overwrite"] * (command is fit))).err


def recorded(folder: Path, name: str = "paper.rec") -> Path:
    """A data package whose logs are in a format of the user's own."""
    shutil.copytree(RIGS, folder)
    described = json.loads((folder / "datapackage.json").read_text())
    logs = {log.path.name: log for log in read_package(RIGS) if log.path}
    for resource in described["resources"]:
        log = logs[resource["path"]]
        (folder / resource["path"]).unlink()
        resource["path"] = Path(resource["path"]).with_suffix(".rec").name
        del resource["hash"]
        columns = {"time": log.time, **log.columns}
        rows = "\n".join(" ".join(repr(float(v)) for v in row) for row in np.stack(list(columns.values()), axis=1))
        (folder / resource["path"]).write_text(f"my recorder\n{' '.join(columns)}\n{rows}\n")
    (folder / "datapackage.json").write_text(json.dumps(described))
    return folder


@pytest.mark.nightly
def test_every_command_takes_a_reader_of_ones_own(stickslip, tmp_path):
    logs = recorded(tmp_path / "logs")
    (tmp_path / "my_reader.py").write_text(READER)
    assert "no known kind of log" in stickslip("fit", logs).err
    reader = ("--reader", "my_reader.py")
    weak = ("--estimator", "weak-form", "--json")
    ours = stickslip("fit", RIGS, *weak).json
    fitted = stickslip("fit", logs, *reader, *weak, "--result", "fit.json").json
    assert fitted["parameters"] == ours["parameters"]
    assert stickslip("laws", logs, *reader).code == 0
    assert stickslip("compare", "fit.json", logs, *reader, "--no-uncertainty").code == 0
    assert (
        stickslip("report", "fit.json", logs, *reader, "--no-residuals", "--no-uncertainty", "-o", "a.html").code == 0
    )
    broken = next(logs.glob("*.rec"))
    broken.write_text("another recorder\n")
    answer = stickslip("fit", logs, *reader)
    assert answer.code == 2 and "my_reader.py, line 7: AssertionError: not of my recorder" in answer.err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("READER = Reader('.rec', read)", "The suffixes of a reader are a tuple"),
        ("READER = read", "must be a Reader"),
        ("READER = Reader(('.rec',), lambda path: {'time': [0.0]})", "must return a Table"),
        ("READER = Reader(('.rec',), lambda path: Table('x', {'time': ['a']}))", "column 'time' is not of numbers"),
        ("READER = Reader(('.rec',), lambda path: Table('x', {'a': [1.0], 'b': [1.0, 2.0]}))", "have one shape"),
        ("READER = Reader(('.rec',), lambda path: Table('x', {}))", "no column"),
    ],
)
def test_a_reader_that_is_none(stickslip, tmp_path, text, said):
    (tmp_path / "my_reader.py").write_text(READER.replace('READER = Reader((".rec",), read)', text))
    (tmp_path / "a.rec").write_text("")
    answer = stickslip("fit", "a.rec", "--reader", "my_reader.py", "--set", "J=1")
    assert answer.code == 2 and said in answer.err


@pytest.mark.nightly
def test_installed_packages_offer_models_and_readers(stickslip, own, tmp_path_factory, monkeypatch):
    site = tmp_path_factory.mktemp("site")
    package = site / "my_package"
    package.mkdir()
    shutil.move(own / "my_model.py", package / "blocks.py")
    shutil.move(own / "constants.py", site / "constants.py")
    (package / "__init__.py").write_text("")
    (package / "recorder.py").write_text(READER)
    information = site / "my_package-1.2.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: my-package\nVersion: 1.2\n")
    (information / "entry_points.txt").write_text(
        "[stickslip.oscillators]\nour_block = my_package.blocks:MODEL\n"
        "[stickslip.readers]\nour_recorder = my_package.recorder:READER\n"
    )
    monkeypatch.syspath_prepend(site)
    rows = {row["name"]: row for row in stickslip("models", "--json").json["models"]}
    assert rows["our_block"]["origin"] == "my-package 1.2" and rows["disc_rig"]["origin"] == "stickslip"
    assert "my-package 1.2" in stickslip("models").out
    blocks = package / "blocks.py"
    blocks.write_text(blocks.read_text().replace(rows["our_block"]["title"], "Another title"))
    monkeypatch.delitem(sys.modules, "my_package.blocks")  # another process
    rows = {row["name"]: row for row in stickslip("models", "--json").json["models"]}
    assert rows["our_block"]["title"] == "Another title"
    assert stickslip("simulate", "our_block", "--until", "5", "--json").json["contacts"]["belt"]["events"] > 2
    assert stickslip("export", "our_block").code == 0 and (own / "own_block.fmu").is_file()
    assert "Did you mean 'our_block'" in stickslip("show", "our_blok").err
    logs = recorded(own / "logs")
    assert stickslip("fit", logs, "--estimator", "weak-form").code == 0
