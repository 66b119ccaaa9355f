"""What a page is made of: the model as it is described there, its range of values, its policy, and what is refused."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re
import zipfile
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import sympy
from quick_export import QUICK

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import checked_page
from fmu_models.codegen.package import export, export_map
from fmu_models.explorer import module
from fmu_models.explorer.description import describe
from fmu_models.explorer.page import Explorer, explore
from fmu_models.explorer.subject import subject_of
from fmu_models.fmu.load import load
from fmu_models.language.friction import Friction
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.maps import MAPS
from fmu_models.simulation.run import simulate

RAMP = """
title = "A belt that speeds up"
model = "block_on_belt"
stop_time = "3 s"
[parameters]
N = "20 N"
[free]
mu_s = 0.7
[drives]
v_belt = { from = "0.1 m/s", to = "0.2 m/s", begin = 0, end = "1 s" }
[start]
x = "2 cm"
"""


def chain(masses: int) -> Mechanism:
    k, m = Parameter("k", 2.0, "N/m", "stiffness"), Parameter("m", 1.0, "kg", "mass", positive=True)
    x = [Coordinate(f"x{i}", "m", f"place of mass {i}", start=0.1 * i) for i in range(masses)]
    force, mu = (
        Parameter("N", 0.1, "N", "normal force", minimum=0.0),
        Parameter("mu", 0.3, "1", "friction", minimum=0.0),
    )
    return Mechanism(
        name="chain",
        title="Chain of masses, the first of which rubs",
        source="none",
        coordinates=x,
        kinetic_energy=m * sympy.Add(*(q.v**2 for q in x)) / 2,
        potential_energy=k * sympy.Add(*((b - a) ** 2 for a, b in pairwise(x))) / 2,
        contacts=[Friction(name="floor", slip=x[0].v, law=Coulomb(force, mu), description="floor")],
    )


def test_of_more_than_six_coordinates_those_to_draw_are_asked_for():
    subject = subject_of(chain(7))
    with pytest.raises(StickslipError, match=r"7 coordinates \(x0, x1.*Say which: --plot x0,x1"):
        describe(subject)
    assert describe(subject, ["x6", "x0"])["planes"] == [[6, 13], [0, 7]]
    with pytest.raises(StickslipError, match=r"no coordinate 'x9' to draw"):
        describe(subject, ["x9"])
    assert describe(subject, ["x1"])["model"] == ""  # declared in Python: no command line names it


def test_ranges_come_from_the_declaration():
    described = describe(subject_of("hinge_clearance"))
    ranges = {q["name"]: (q["low"], q["high"], q["log"]) for q in described["parameters"]}
    assert ranges["ce"] == (0.0, 1.0, [0.009, 1.0])  # both bounds are declared
    assert ranges["k0"] == (0.0, 900.0, [3.0, 30000.0])  # one is
    assert ranges["tau"] == (-3.0, 3.0, None)  # none, and zero by default
    assert [c["kind"] for c in described["contacts"]] == ["stop", "stop"]
    assert described["contacts"][0]["states"]["4"] == "released while still inside"


def test_a_scene_starts_at_its_values_and_all_of_them_can_be_moved(tmp_path: Path):
    (tmp_path / "ramp.toml").write_text(RAMP)
    subject = subject_of(tmp_path / "ramp.toml")
    described = describe(subject)
    values = {q["name"]: q["value"] for kind in ("parameters", "inputs", "states") for q in described[kind]}
    assert (values["N"], values["mu_s"], values["v_belt"], values["x"]) == (20.0, 0.7, 0.1, 0.02)
    assert described["until"] == 3.0 and "v_belt varies over time" in described["notes"][0]
    with pytest.raises(StickslipError, match="A scene says itself which contacts are in use"):
        subject_of(tmp_path / "ramp.toml", ["belt"])
    assert subject_of("disc_rig_class_a").arguments == "--contacts disc0"


def test_an_fmu_of_ours_is_explored_and_a_map_is_not(tmp_path: Path):
    fmu = export("planar_hopf", tmp_path / "hopf.fmu", fmi_version="2.0")
    assert describe(subject_of(fmu))["planes"] == [[0, 1]]
    with pytest.raises(StickslipError, match="no motion between its steps"):
        subject_of(export_map(MAPS.load("henon"), tmp_path / "henon.fmu"))


def test_an_fmu_of_others_is_refused(tmp_path: Path):
    others = tmp_path / "others.fmu"
    with zipfile.ZipFile(export("planar_hopf", tmp_path / "ours.fmu")) as ours, zipfile.ZipFile(others, "w") as made:
        for name in ours.namelist():
            if not name.startswith("sources/"):
                made.writestr(name, ours.read(name).replace(b'generationTool="stickslip', b'generationTool="Somebody'))
    with pytest.raises(StickslipError, match=r"'others.fmu' was not exported by stickslip.*stickslip simulate"):
        subject_of(others)


@pytest.fixture(scope="module")
def page() -> Explorer:
    return explore("planar_hopf")


def test_its_policy_knows_its_scripts_and_nothing_else(page: Explorer):
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', page.html)
    assert policy is not None
    said = policy[1].replace("&#39;", "'")
    packed = re.search(r'id="script">([^<]+)<', page.html)
    assert packed is not None
    scripts = [
        *re.findall(r"<script>(.*?)</script>", page.html, re.S),
        gzip.decompress(base64.b64decode(packed[1])).decode(),
    ]
    (style,) = re.findall(r"<style>(.*?)</style>", page.html, re.S)
    hashes = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in (*scripts, style)]
    assert re.findall(r"'sha256-([^']+)'", said) == hashes and said.startswith("default-src 'none'; ")
    assert "'unsafe-inline'" not in said and "style=" not in page.html and "http" not in scripts[0]


def test_it_tells_its_version_and_is_the_same_page_again(page: Explorer):
    told = json.loads(re.findall(r'id="model">(.*?)</script>', page.html, re.S)[0])
    assert told["version"] == page.version and f"stickslip {page.version}" in page.html
    assert explore("planar_hopf").html == page.html
    assert repr(page).startswith("Explorer('planar_hopf', ") and page._repr_html_().startswith("<iframe sandbox=")


def test_its_still_picture_is_the_motion_from_the_default_start(page: Explorer):
    (path,) = re.findall(r'<path d="M([^"V]+)" fill="none" stroke="#', page.html)
    right, down = np.array([place.split() for place in path.split("L")], dtype=float).T
    run = simulate(load("planar_hopf"), 20.0, output_times=np.linspace(0.0, 20.0, right.size))
    assert page.planes == (("x1", "x2"),)
    for places, values, room, sign in ((right, run["x1"], 480, 1), (down, run["x2"], 360, -1)):
        # to a scale, within the picture, and up is up
        assert np.corrcoef(values, places)[0, 1] == pytest.approx(sign, abs=1e-4)
        assert 0.0 < places.min() < 0.2 * room and 0.8 * room < places.max() < room


def test_all_that_a_compiler_may_call_is_in_the_module(monkeypatch: pytest.MonkeyPatch):
    """What it does itself for a small model and with optimization: to compare the speeds of nine masses it calls."""
    monkeypatch.setattr(module, "FLAGS", QUICK)
    assert module.wasm(load("planar_hopf")).startswith(b"\0asm")


def test_a_page_is_written_whole_or_not_at_all(page: Explorer, tmp_path: Path):
    with pytest.raises(StickslipError, match=r"end it in \.html"):
        page.write(tmp_path / "page.txt")
    written = page.write(tmp_path / "page.html")
    assert written.read_text("utf-8") == page.html
    with pytest.raises(StickslipError, match="exists already"):
        checked_page(written, overwrite=False)
    assert page.write(written, overwrite=True) == written and list(tmp_path.iterdir()) == [written]
