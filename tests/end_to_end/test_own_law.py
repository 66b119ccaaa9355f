"""A law in the user's own folder goes everywhere that a law of ours goes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fmu_models import oscillators
from fmu_models.language import laws

RIGS = Path(__file__).parents[2] / "data" / "rigs" / "paper_rubber"
LAW = '''"""A fall of friction like Gauss's bell."""

from __future__ import annotations

from dataclasses import dataclass, field

import sympy

from fmu_models.language.dry_friction import DryFriction
from fmu_models.language.law_parameter import coefficient, declared


@dataclass(frozen=True)
class Bell(DryFriction):
    """mu_k + (mu_s - mu_k) exp(-(v/v_s)^2)."""

    N: sympy.Expr
    mu_s: sympy.Expr = field(metadata=coefficient(0.6, "friction coefficient at rest"))
    mu_k: sympy.Expr = field(metadata=coefficient(0.3, "friction coefficient at great slip speed"))
    v_s: sympy.Expr = field(metadata=declared(0.05, "m/s", "width of the bell", 1e-4, 10.0))

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        return self.N * (self.mu_k + (self.mu_s - self.mu_k) * sympy.exp(-((speed / self.v_s) ** 2)))


LAW = Bell
'''
SCENE = """title = "rig under a bell"
source = "mine"
model = "disc_rig"
contacts = ["disc0"]
laws = { disc0 = "my_law.py" }
stop_time = "3 s"
free = { mu_s0 = 0.6, mu_k0 = 0.3, v_s0 = 0.06 }
drives = { w0 = "0.83 rad/s" }

[compute]
kind = "trajectory"

[sensors]
transient = "0 s"
duration = "6 s"
"""


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A folder with a law, and scenes at two drive speeds."""
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "my_law.py").write_text(LAW, encoding="utf-8")
    (folder / "slow.toml").write_text(SCENE, encoding="utf-8")
    (folder / "fast.toml").write_text(SCENE.replace("0.83 rad/s", "1.4 rad/s"), encoding="utf-8")
    return folder


@pytest.mark.nightly
def test_a_law_of_the_user_goes_through_every_command(stickslip, mine, tmp_path):
    # the scene finds its law beside it, wherever the command runs
    assert "rig under a bell" in stickslip("scene", mine / "slow.toml", "--trust").out
    for name in ("slow", "fast"):
        stickslip("emulate", mine / f"{name}.toml", f"logs_{name}", "--trust")
    logs = ("logs_slow", "logs_fast")
    fitted = stickslip("fit", *logs, "--law", mine / "my_law.py", "--result", "fit.json", "--figure", "fit.png")
    assert "Bell law of disc0" in fitted.out
    found = json.loads(Path("fit.json").read_text("utf-8"))
    values = {one["name"]: one["value"] for one in found["parameters"]}
    assert values == pytest.approx({"mu_s": 0.6, "mu_k": 0.3, "v_s": 0.06}, rel=0.03)
    assert [one["meaning"] for one in found["parameters"]][2] == "width of the bell"
    weak = stickslip("fit", *logs, "--law", f"{mine / 'my_law.py'}:Bell", "--estimator", "weak-form", "--json")
    assert json.loads(weak.out)["law"] == "Bell"
    assert "pass" in stickslip("compare", "fit.json", *logs, "--trust").out
    assert stickslip("report", "fit.json", *logs, "-o", "report.html", "--trust").code == 0
    assert stickslip("design", "fit.json", "--speeds", "0.83", "--loads", "4.905", "--trust").code == 0
    assert "v_s0" in stickslip("apply", "fit.json", mine / "slow.toml", "-o", mine / "fitted.toml", "--trust").out
    assert stickslip("apply", "fit.json", "-o", "fitted.fmu", "--trust").code == 0
    assert Path("fitted.fmu").is_file()


def test_a_changed_law_is_taken_as_it_is_now(stickslip, mine):
    before = json.loads(stickslip("scene", mine / "slow.toml", "--trust", "--json").out)
    (mine / "my_law.py").write_text(LAW.replace("** 2)", "** 4)"), encoding="utf-8")
    assert json.loads(stickslip("scene", mine / "slow.toml", "--trust", "--json").out) != before


def test_a_copy_of_the_smallest_law_of_ours_is_a_law(stickslip, mine):
    (mine / "copied.py").write_bytes((Path(laws.__file__).parent / "coulomb.py").read_bytes())
    stickslip("emulate", mine / "slow.toml", "logs", "--trust")
    fitted = stickslip("fit", "logs", "--law", mine / "copied.py", "--estimator", "weak-form", "--json")
    assert [one["name"] for one in json.loads(fitted.out)["parameters"]] == ["mu"]


def test_a_law_of_the_user_in_a_mechanism(mine):
    law = laws.load("my_law.py", beside=mine)
    belt = oscillators.load("block_on_belt")
    bell = belt.with_law(belt=law.around(belt.law_of("belt")))
    assert bell.name == "block_on_belt_bell"
    assert [p.name for p in bell.parameters] == ["m", "k", "c", "N", "mu_s", "mu_k", "v_s"]


@pytest.mark.parametrize(
    ("was", "now", "lesson"),
    [
        (
            "speed / self.v_s",
            "speed / self.width",
            "my_law.py, line 23: AttributeError: 'Bell' object has no attribute",
        ),
        ("LAW = Bell", "LAW = 3", "is no law: it must be a class"),
        ("LAW = Bell", "", "defines no LAW. End it with LAW = ..., the law."),
        ("self.N * (", "(", "is not in proportion to the load N"),
        ("sympy.exp(", "sympy.airyai(", "cannot be turned into numpy code"),
        (
            ' = field(metadata=coefficient(0.3, "friction coefficient at great slip speed"))',
            "",
            "has a part 'mu_k' that",
        ),
        ("class Bell(", "class Bell(]", "my_law.py, line 14"),
    ],
)
def test_what_is_wrong_in_a_law_is_told_in_words(stickslip, mine, was, now, lesson):
    assert was in LAW
    (mine / "my_law.py").write_text(LAW.replace(was, now), encoding="utf-8")
    answer = stickslip("fit", RIGS, "--law", mine / "my_law.py", "--estimator", "weak-form")
    assert answer.code == 2
    assert lesson in " ".join(answer.err.split())
