"""An analysis of an installed package: one file gives the command, the kind of a scene, JSON and the picture."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

ANALYSIS = '''
from dataclasses import dataclass
from typing import Annotated, ClassVar

import pandas

from fmu_models.analyses.declaration import Analysis, Option
from fmu_models.families.jobs import Jobs
from fmu_models.base.shown import Pictured, draw


@dataclass(frozen=True, eq=False)
class Largest(Pictured):
    RECORD: ClassVar = ("model", "steps", "largest=value")

    model: str
    steps: int
    value: float

    @property
    def frame(self):
        return pandas.DataFrame({"largest": [self.value]})


def largest_point(system, start=None, *, steps: Annotated[int, Option("Steps that are looked at.", minimum=1)] = 20,
                  progress=None):
    """Find the largest value of the first state at the section."""
    rows = system.make(Jobs(system.start(start)[None], rows=steps))
    return Largest(system.name, steps, float(rows.points[0, :, 0].max()))


@draw.register
def _(value: Largest, axes):
    axes.plot([value.value], "o")


ANALYSIS = Analysis(
    function=largest_point,
    numbers=lambda found: {"largest": found.value},
    results="`largest`",
    example="logistic --set r=4 --start x=0.3",
    label="looking",
    page=False,
)
'''
SCENE = """
title = "Largest displacement at the section"
source = "none"
model = "discontinuous_support"
stop_time = "10 s"

[parameters]
m = "1 kg"
k = "1 N/m"
c = "0.05 N s/m"
cs = "0.6 N s/m"
ks = "300 N/m"
g = "1000 m"
f0 = "0 N"
omega = "1 rad/s"

[start]
x = 1
v = 0

[compute]
kind = "largest"
period = "6.283185307179586 s"
steps = 3
"""


@pytest.fixture
def package(tmp_path_factory, monkeypatch) -> Path:
    site = tmp_path_factory.mktemp("site")
    (site / "peaks.py").write_text(ANALYSIS)
    information = site / "peaks-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: peaks\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(
        "[stickslip.analyses]\nlargest = peaks:ANALYSIS\n[stickslip.views]\npeaks = peaks\n"
    )
    monkeypatch.syspath_prepend(site)
    return site


def test_an_analysis_of_a_package_is_a_command(stickslip, package, tmp_path):
    shown = stickslip("largest", "--help")
    assert "Find the largest value" in shown.out and "--steps" in shown.out
    answer = stickslip("largest", "logistic", "--set", "r=4", "--start", "x=0.3", "--steps", 9, "--json")
    # the closed form of the chaotic logistic map
    angle = math.asin(math.sqrt(0.3))
    known = max(math.sin(2**k * angle) ** 2 for k in range(1, 10))
    assert answer.json["steps"] == 9 and answer.json["largest"] == pytest.approx(known, abs=1e-12)
    assert stickslip("largest", "logistic", "--figure", "peak.svg").code == 0
    assert (tmp_path / "peak.svg").is_file()
    assert stickslip("largest", "logistic", "--steps", 0).code == 2


def test_it_is_a_kind_of_a_scene(stickslip, package, tmp_path):
    (tmp_path / "largest.toml").write_text(SCENE)
    answer = stickslip("scene", "largest.toml", "--json")
    # the free decay, far from the support, after one period of the section
    rate = math.sqrt(1.0 - 0.025**2)
    time = 2.0 * math.pi
    known = math.exp(-0.025 * time) * (math.cos(rate * time) + 0.025 / rate * math.sin(rate * time))
    assert answer.json["results"][0]["values"]["largest"] == pytest.approx(known, rel=1e-11)
    (tmp_path / "largest.toml").write_text(SCENE.replace("steps", "stpes"))
    assert "stpes" in stickslip("scene", "largest.toml").err
