"""stickslip new: what it writes runs as it is, and so does the test that comes with it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fmu_models.base.toml_document import read_document
from fmu_models.language.mechanism import Mechanism
from fmu_models.oscillators import MODELS
from fmu_models.scene.check import checked_scene

ROOT = Path(__file__).parents[2]


def passes(folder: Path, test: str) -> bool:
    """Whether pytest, as a user calls it in that folder, is content with a file."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", test]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    print(done.stdout)
    return done.returncode == 0


def test_a_new_model_simulates_and_exports_and_its_test_passes(stickslip, tmp_path):
    assert stickslip("new", "model", "my_rig", "--json").json["files"] == ["my_rig.py", "test_my_rig.py"]
    run = stickslip("simulate", "my_rig.py", "--until", "5", "--json").json
    assert run["contacts"]["belt"]["events"] > 2
    assert stickslip("export", "my_rig.py").code == 0 and (tmp_path / "my_rig.fmu").is_file()
    assert passes(tmp_path, "test_my_rig.py")
    text = (tmp_path / "my_rig.py").read_text().replace("k * x**2", "1.1 * k * x**2")
    (tmp_path / "my_rig.py").write_text(text)
    assert not passes(tmp_path, "test_my_rig.py")


@pytest.mark.nightly
def test_a_new_scene_of_ones_own_model_runs_and_its_test_passes(stickslip, tmp_path):
    stickslip("new", "model", "my_rig")
    assert stickslip("new", "scene", "my_rig.py").code == 0
    answer = stickslip("scene", "my_rig_scene.toml", "--trust", "--json")
    assert answer.code == 0 and answer.json["results"][0]["values"]["events"] > 2
    assert passes(tmp_path, "test_my_rig_scene.py")
    scene = tmp_path / "my_rig_scene.toml"
    scene.write_text(scene.read_text() + "[[reference]]\nx = 7.0\n")
    assert not passes(tmp_path, "test_my_rig_scene.py")


@pytest.mark.parametrize("name", MODELS.members())
def test_a_new_scene_of_every_model_is_one(stickslip, tmp_path, name):
    assert stickslip("new", "scene", name).code == 0
    text = (tmp_path / f"{name}_scene.toml").read_text()
    assert checked_scene(read_document(tmp_path / f"{name}_scene.toml")).model == name
    # what is commented out is right, too
    (tmp_path / "all.toml").write_text("".join(line.removeprefix("# ") for line in _values(text)))
    whole = checked_scene(read_document(tmp_path / "all.toml"))
    contacts = tuple(contact.name for contact in MODELS.load(name).contacts)
    assert whole.contacts == (contacts if contacts and isinstance(MODELS.load(name), Mechanism) else None)


def _values(text: str) -> list[str]:
    """Lines of a scene that state something, commented out or not, up to the references."""
    lines = text.partition("# What is known")[0].splitlines(keepends=True)
    return [line for line in lines if " = " in line.removeprefix("# ")[:40] or line.startswith("[")]


def test_nothing_is_overwritten_unasked(stickslip, tmp_path):
    (tmp_path / "test_my_rig.py").write_text("mine")
    answer = stickslip("new", "model", "my_rig")
    assert answer.code == 2 and "test_my_rig.py" in answer.err and "exists already" in answer.err
    assert not (tmp_path / "my_rig.py").exists() and (tmp_path / "test_my_rig.py").read_text() == "mine"
    assert "exists already" in stickslip("new", "law", "my_rig").err
    assert stickslip("new", "model", "my_rig", "--overwrite").code == 0
    for name in ("3x", "my rig", "../x", "class", ""):
        assert "cannot be a name" in stickslip("new", "model", name).err


def test_a_new_law_is_simulated_and_fitted_and_its_test_passes(stickslip, tmp_path):
    assert stickslip("new", "law", "my_law").code == 0
    assert passes(tmp_path, "test_my_law.py")
    text = (tmp_path / "my_law.py").read_text()
    assert "class MyLaw(" in text
    (tmp_path / "my_law.py").write_text(text.replace("** 2)", "** 4)"))
    assert not passes(tmp_path, "test_my_law.py")
