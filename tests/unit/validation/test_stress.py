"""The stress grid: what it covers, and that its judge sees an answer that is wrong."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import threading
from functools import cache
from typing import Any

import numpy as np
import pytest

from fmu_models import oscillators
from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built, variant
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.friction import Friction
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Parameter
from fmu_models.validation.stress import report, trial
from fmu_models.validation.stress.cases import Case, grid
from fmu_models.validation.stress.equations import StressEquations
from fmu_models.validation.stress.invariants import invariants
from fmu_models.validation.stress.judge import TIGHT, StressCell, StressSubject, judge
from fmu_models.validation.stress.roles import roles
from fmu_models.validation.stress.workers import judged, judges

MODELS = ("block_on_belt", "bouncing_ball", "discontinuous_support", "impact_pair", "planar_hopf")


@cache
def subject(name: str) -> StressSubject:
    return StressSubject.of(oscillators.load(name), Fmu.open(built(name)))


def case(model: str, **changes: Any) -> Case:
    """Ten periods of the defaults, or with changes."""
    (default,) = [one for one in grid(model, oscillators.load(model), subject(model).equations) if not one.what][:1]
    return dataclasses.replace(default, **changes)


def test_roles_are_read_from_the_declaration():
    found = {role.name: (role.does, role.of) for role in roles(oscillators.load("discontinuous_support"))}
    assert found == {
        "m": ("inertia", "body"),
        "k": ("stiffness", "body"),
        "c": ("damping", "body"),
        "f0": ("amplitude", "body"),
        "omega": ("frequency", "body"),
        "ks": ("stiffness", "stop"),
        "cs": ("damping", "stop"),
        "g": ("gap", "stop"),
    }
    scaled = {role.name: role.does for role in roles(oscillators.load("hinge_clearance"))}
    assert scaled == {"k0": "stiffness", "ce": "restitution", "delta": "gap", "zeta": "damping", "f": "frequency"}


@pytest.mark.parametrize("name", oscillators.names())
def test_the_grid_covers_every_model(name):
    """Defaults, starts, late and long runs, and every value of a role that a model has; names are unique."""
    model = oscillators.load(name)
    cases = grid(name, model, StressEquations(model))
    names = [one.name for one in cases]
    assert len(set(names)) == len(names)
    assert {"default", "start at rest", "late start", "1e6 periods"} <= set(names)
    assert {name for role in roles(model) if role.does == "stiffness" for name in (f"{role.name}=1e+12",)} <= set(names)
    contacts = {c.name for c in model.contacts}
    starts = {name.split(" on ")[1] for name in names if name.startswith("start on ")}
    assert contacts <= {contact for start in starts for contact in start.split(" and ")}
    assert all(one.duration > 0 for one in cases)


def test_a_new_model_needs_nothing():
    mass, mu = Parameter("mass", 2.0, "kg", "mass", positive=True), Parameter("mu", 0.3, "1", "friction", minimum=0.0)
    load = Parameter("load", 5.0, "N", "normal force", minimum=0.0)
    x = Coordinate("x", "m", "place", velocity="v", v_start=1.0)
    block = Mechanism(
        name="sliding_block",
        title="Block that slides to rest",
        source="none",
        coordinates=[x],
        kinetic_energy=mass * x.v**2 / 2,
        contacts=[Friction(name="floor", slip=x.v, law=Coulomb(load, mu))],
    )
    names = {one.name for one in grid("sliding_block", block, StressEquations(block))}
    assert {"mass=2e-09", "mu=0", "load=1e+09", "start on floor", "time x 2^30"} <= names


@pytest.mark.parametrize("name", MODELS)
def test_right_answers_are_accurate(name):
    cell = judge(case(name), subject(name))
    assert (cell.verdict, cell.reached) == ("accurate", 1.0)
    assert cell.checks >= 7
    assert cell.error is not None and cell.error < 1e-12


@pytest.mark.parametrize(
    ("model", "wrong", "check", "said"),
    [
        ("discontinuous_support", {"ks": 10.1}, "states", "force not of the law"),
        ("discontinuous_support", {"c": 0.0501}, "equations", "rate of v"),
        ("discontinuous_support", {"g": 3.99}, "states", "support: "),
        ("block_on_belt", {"mu_k": 0.36}, "states", "force not of the law"),
        ("bouncing_ball", {"e": 0.51}, "events", "restitution of table"),
        ("impact_pair", {"D": 5.9}, "events", "off its boundary"),
        ("planar_hopf", {"mu": 1.1}, "equations", "rate of x2"),
    ],
)
def test_an_engine_with_another_parameter_fails(monkeypatch, model, wrong, check, said):
    """The judge is told the defaults; the engine has the wrong value in whatever units, mirrored or not."""
    run = trial.simulate
    ratio = {name: value / subject(model).equations.parameters[name] for name, value in wrong.items()}

    def other(fmu: Fmu, stop: float, **options: Any) -> Any:
        given = subject(model).equations.parameters | options["parameters"]
        return run(fmu, stop, **options | {"parameters": given | {n: given[n] * r for n, r in ratio.items()}})

    monkeypatch.setattr(trial, "simulate", other)
    cell = judge(case(model), subject(model))
    assert cell.verdict == "failed"
    assert cell.check == check
    assert said in cell.message


def tampered(name: str, change: Any, when: Any = lambda options: True) -> Any:
    """``simulate`` with one column of its result changed."""
    run = trial.simulate

    def simulate(fmu: Fmu, stop: float, **options: Any) -> Any:
        result = run(fmu, stop, **options)
        values = dict(result.values)
        if when(options):
            values[name] = change(values[name], result.time / result.time[-1])
        return dataclasses.replace(result, values=values)

    return simulate


def late(column: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Wrong by 2 % in the second half."""
    return np.where(share > 0.5, 1.02 * column, column)


@pytest.mark.parametrize(
    ("model", "check", "simulate"),
    [
        ("discontinuous_support", "energy", tampered("energy", late)),
        ("discontinuous_support", "energy", tampered("power_input", lambda p, _: 1.01 * p)),
        ("discontinuous_support", "states", tampered("support_state", lambda s, _: np.where(s == 3, 2, s))),
        ("discontinuous_support", "equations", tampered("der(v)", late)),
        ("block_on_belt", "states", tampered("belt_state", lambda s, _: np.where(s == -1, 0, s))),
        ("bouncing_ball", "states units", tampered("x", lambda x, share: np.where(share > 0.5, x - 0.01, x))),
        ("planar_hopf", "equations", tampered("der(x2)", late)),
        ("block_on_belt", "tolerance", tampered("x", late, lambda options: options["tolerance"] == TIGHT)),
        (
            "block_on_belt",
            "units mirror",
            tampered("x", late, lambda options: options["parameters"].get("m", 1.0) != 1.0),
        ),
        ("block_on_belt", "units mirror", tampered("x", late, lambda options: options["inputs"].get("v_belt", 0) < 0)),
        ("block_on_belt", "finite", tampered("x", lambda x, share: np.where(share > 0.9, np.nan, x))),
    ],
)
def test_a_wrong_column_fails(monkeypatch, model, check, simulate):
    monkeypatch.setattr(trial, "simulate", simulate)
    cell = judge(case(model), subject(model))
    assert cell.verdict == "failed"
    assert cell.check in check.split()


def test_a_hair_is_not_a_wrong_answer_but_no_accurate_one(monkeypatch):
    monkeypatch.setattr(trial, "simulate", tampered("energy", lambda e, share: e * (1 + 1e-5 * (share > 0.5))))
    cell = judge(case("discontinuous_support"), subject("discontinuous_support"))
    assert (cell.verdict, cell.check) == ("degraded", "energy")
    assert cell.error is not None and 1e-8 < cell.error < 1e-5  # of the work done in a stretch, which is larger


def test_what_is_refused_names_the_reason():
    cell = judge(case("impact_pair", parameters={"D": 0.0}), subject("impact_pair"))
    assert (cell.verdict, cell.error) == ("refused", None)
    assert cell.message == "the walls overlap: their distance D must be positive"


def test_a_stiff_case_covers_as_much_time_as_its_steps_allow():
    cell = judge(case("block_on_belt", parameters={"k": 1e12}), subject("block_on_belt"))
    assert cell.verdict == "accurate"
    assert 0 < cell.reached < 0.1
    assert "of the time]" in report.sentence(cell)


def test_invariants_are_found_in_the_declaration():
    assert invariants(variant("block_on_belt", laws={"belt": "directional"})).mirror is None
    mirrored = {name: invariants(oscillators.load(name)).mirror for name in MODELS}
    assert mirrored["discontinuous_support"] is None
    assert mirrored["bouncing_ball"] is None
    belt, pair = mirrored["block_on_belt"], mirrored["impact_pair"]
    assert belt and belt.negated == {"v_belt"} and not belt.turned
    assert pair and pair.turned == {"phi0"} and not pair.negated
    assert invariants(oscillators.load("bouncing_ball")).divergence == 0


def test_a_child_that_does_not_answer_is_a_failed_cell():
    with judges(1, patience=1e-3) as pool:
        (cell,) = judged([case("planar_hopf")], lambda _: None, pool)
    assert (cell.verdict, cell.check) == ("failed", "process")
    assert "no answer within 0.001 s" in cell.message


def test_a_child_that_dies_is_a_failed_cell_and_the_others_go_on(monkeypatch):
    cases = [case("planar_hopf"), case("planar_hopf", name="again")]
    started: list[subprocess.Popen[bytes]] = []
    start = subprocess.Popen.__init__

    def noted(self: subprocess.Popen[bytes], *arguments: Any, **options: Any) -> None:
        start(self, *arguments, **options)
        started.append(self)

    monkeypatch.setattr(subprocess.Popen, "__init__", noted)
    timer = threading.Timer(0.3, lambda: started[0].kill())  # while it is still importing
    timer.start()
    with judges(1) as pool:
        cells = list(judged(cases, lambda _: None, pool))
    timer.join()
    assert [cell.verdict for cell in cells] == ["failed", "accurate"]
    assert "the process died" in cells[0].message


def test_the_report_is_complete(tmp_path):
    one, two = case("planar_hopf"), case("impact_pair", name="D=0", of="impact", what="gap")
    cells = [
        StressCell(one, "accurate", 1e-15, "energy", ""),
        StressCell(two, "refused", None, "", "the walls overlap"),
        StressCell(dataclasses.replace(two, name="D=1"), "failed", float("inf"), "finite", "x not finite"),
    ]
    content = report.content(cells, asked=4)
    assert json.loads(json.dumps(content, allow_nan=False)) == content
    assert content["totals"] == {"accurate": 1, "degraded": 0, "refused": 1, "failed": 1}
    assert (content["asked"], content["finished"]) == (4, 3)
    report.draw(cells, tmp_path / "heat.png")
    assert (tmp_path / "heat.png").stat().st_size > 1000
    with pytest.raises(StickslipError, match="exists"):
        report.draw(cells, tmp_path / "heat.png")
