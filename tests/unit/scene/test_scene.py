"""Scenes as files: what they mean, and what each mistake is answered with."""

from __future__ import annotations

import dataclasses
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scene_file import CLASS_A, scene_of
from timed_scene import time_runs

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.compute import arguments, compare, compute
from fmu_models.scene.kinds.kind import period
from fmu_models.scene.left_out import left_out, size, whole_model
from fmu_models.scene.read import read_scene
from fmu_models.scene.reduce import built_scene, export_scene, reduced, unfolded
from fmu_models.scene.scene import Compute, Scene
from fmu_models.simulation.run import simulate


def test_units_are_converted(tmp_path: Path) -> None:
    text = CLASS_A.replace('"8 N"', '"0.008 kN"').replace('"0.83 rad/s"', '"8 rpm"').replace('"5 s"', '"5000 ms"')
    scene = scene_of(tmp_path, text + '\n[start]\ntheta = "90 deg"\nomega = 2\n')
    assert scene.fixed["N0"] == pytest.approx(8.0, rel=1e-15)
    assert scene.drives["w0"].constant == pytest.approx(8 * 2 * math.pi / 60, rel=1e-15)
    assert scene.stop_time == 5.0
    assert scene.start == {"theta": pytest.approx(math.pi / 2, rel=1e-15), "omega": 2.0}


def test_a_scene_read_again_is_the_same_and_needs_no_model(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, CLASS_A + "\n[[reference]]\nevents = 8\n")
    assert Scene.from_json(scene.to_json()) == scene
    built_scene(scene)
    code = (
        "import sys; from fmu_models.scene.read import read_scene; from fmu_models.scene.reduce import built_scene\n"
        "from fmu_models.scene.compute import compute; from fmu_models.fmu.fmu import Fmu\n"
        f"scene = read_scene({str(tmp_path / 'given.toml')!r}); compute(scene, Fmu.open(built_scene(scene)))\n"
        "heavy = {'sympy', 'pint', 'matplotlib', 'scipy', 'pandas'} & set(sys.modules); assert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


DATA = Path(__file__).parents[3] / "data"
SHIPPED = sorted([*(DATA / "scenes").glob("*.toml"), *(DATA / "systems_of_the_literature").glob("*.toml")])


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_every_shipped_scene_is_the_same_from_its_own_words(path: Path) -> None:
    scene = read_scene(path)
    read = Scene.from_json(scene.to_json())
    assert read == scene and read.to_json() == scene.to_json() and len(SHIPPED) > 100


def test_the_fmu_holds_only_what_the_scene_uses(tmp_path: Path) -> None:
    """Numbers of parts by the XML, against the whole model."""
    scene = scene_of(tmp_path, CLASS_A)
    small, large = Fmu.open(built_scene(scene)), whole_model(scene)
    assert (small.contacts, small.parameters, small.inputs, small.outputs) == (["disc0"], [], ["w0"], ["F0"])
    a, b = size(small), size(large)
    assert (a.contacts, a.indicators, a.parameters, a.inputs, a.outputs) == (1, 1, 0, 1, 1)
    assert (b.contacts, b.indicators, b.parameters, b.inputs, b.outputs) == (2, 2, 13, 2, 10)
    assert a.bytes < b.bytes
    assert small.variables["w0"].start == "0.83"


def test_the_fmu_alone_does_what_the_scene_says(tmp_path: Path) -> None:
    """Start values, drives and free parameters are those of the scene, for other tools."""
    text = CLASS_A + '\n[start]\ntheta = "5 deg"\nomega = 0.3\n[free]\nmu_s0 = 0.6\n'
    scene = scene_of(tmp_path, text)
    fmu = Fmu.open(built_scene(scene))
    alone, told = simulate(fmu, 5.0), simulate(fmu, **arguments(scene))
    assert alone["theta"][0] == math.radians(5.0)
    assert np.array_equal(alone["theta"], told["theta"])


def test_internal_states_go_with_their_contacts(tmp_path: Path) -> None:
    elastic = '\n[laws]\ndisc0 = "lugre"\n'
    one = Fmu.open(built_scene(scene_of(tmp_path, CLASS_A + elastic)))
    both = Fmu.open(built("disc_rig", laws={"disc0": "lugre", "disc1": "lugre"}))
    assert (one.states, both.states) == (["theta", "omega", "z0"], ["theta", "omega", "z0", "z1"])


def test_same_trajectory_as_the_whole_model(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, CLASS_A.replace("5 s", "25 s"))
    runs = time_runs(scene, pairs=1)
    assert runs.muted == {"N1": 0.0}
    assert runs.difference is not None and runs.difference < 1e-12


def test_a_drive_from_a_log_is_read_anew_when_the_log_changes(tmp_path: Path) -> None:
    text = re.sub(r"w0 = .*", 'w0 = "log.csv:speed"', CLASS_A)
    for end in (0.9, 0.7):
        (tmp_path / "log.csv").write_text(f"time [ms],speed [deg/s]\n0,{math.degrees(0.5)}\n5000,{math.degrees(end)}\n")
        scene = scene_of(tmp_path, text)
        assert Scene.from_json(scene.to_json()) == scene
        run = simulate(Fmu.open(built_scene(scene)), **arguments(scene))
        assert run["w0"] == pytest.approx(0.5 + (end - 0.5) * run.time / 5.0)
    (tmp_path / "log.csv").write_text("time [s],speed [rad/s]\n0,0.5\n4,0.6\n")
    with pytest.raises(
        StickslipError, match=r"line \d+: The signal for input 'w0' covers 0 s to 4 s, the run 0 s to 5"
    ):
        scene_of(tmp_path, text)


@pytest.mark.parametrize("held", [True, False])
def test_an_input_may_be_a_constant(tmp_path: Path, held: bool) -> None:
    """Under [parameters] it is folded; the motion is the same."""
    text = CLASS_A.replace("[drives]\n", "") if held else CLASS_A
    scene = scene_of(tmp_path, text)
    fmu = Fmu.open(built_scene(scene))
    assert fmu.inputs == ([] if held else ["w0"])
    run = simulate(fmu, **arguments(scene))
    whole = simulate(Fmu.open(built("disc_rig", contacts=["disc0"])), 5.0, parameters={"N0": 8.0}, inputs={"w0": 0.83})
    assert run["theta"] == pytest.approx(whole["theta"], abs=1e-13)
    assert set(unfolded(scene).drives) == {"w0"}


def test_free_parameters_stay_parameters(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, CLASS_A + "\n[free]\nmu_s0 = 0.6\n")
    fmu = Fmu.open(built_scene(scene))
    assert fmu.parameters == ["mu_s0"]
    run = simulate(fmu, **arguments(scene, parameters={"mu_s0": 0.5}))
    whole = simulate(
        Fmu.open(built("disc_rig", contacts=["disc0"])), 5.0, parameters={"N0": 8.0, "mu_s0": 0.5}, inputs={"w0": 0.83}
    )
    assert run["theta"] == pytest.approx(whole["theta"], abs=1e-13)
    with pytest.raises(StickslipError, match=r"constant of scene 'given'\. Move it to \[free\]"):
        arguments(scene, parameters={"N0": 5.0})
    with pytest.raises(StickslipError, match="mu_k0 exceeds mu_s0"):
        simulate(fmu, **arguments(scene, parameters={"mu_s0": 0.1}))


def test_a_drive_may_vary(tmp_path: Path) -> None:
    ramp = '{ from = "0.2 rad/s", to = "0.8 rad/s", begin = "1 s", end = "3 s" }'
    run = simulate(
        Fmu.open(built_scene(scene := scene_of(tmp_path, CLASS_A.replace('"0.83 rad/s"', ramp)))),
        **arguments(scene),
        output_times=[0.0, 1.0, 2.0, 3.0, 5.0],
    )
    assert run["w0"] == pytest.approx([0.2, 0.2, 0.5, 0.8, 0.8], rel=1e-14)


def test_the_same_content_is_built_once(tmp_path: Path) -> None:
    """What is computed does not matter to the FMU; what it is made of does."""
    scene = scene_of(tmp_path, CLASS_A)
    longer = dataclasses.replace(scene, stop_time=9.0)
    assert built_scene(longer) == built_scene(scene)
    other = dataclasses.replace(scene, fixed={**scene.fixed, "N0": 7.0})
    assert built_scene(other) != built_scene(scene)
    export_scene(scene, tmp_path / "out.fmu", fmi_version="2.0")
    assert Fmu.open(tmp_path / "out.fmu").fmi == 2


def test_what_is_left_out_says_why(tmp_path: Path) -> None:
    parts = {(part.kind, part.name): part.why for part in left_out(scene_of(tmp_path, CLASS_A))}
    assert parts["contact", "disc1"] == "not among the contacts in use"
    assert parts["parameter", "N0"] == "constant of the code, 8 N"
    assert parts["parameter", "N1"] == parts["input", "w1"] == "belongs to contact disc1"
    assert parts["output", "slip0"] == parts["output", "energy"] == "not asked for"
    assert parts["output", "F1"] == "shows contact disc1"
    assert ("parameter", "R") in parts and ("output", "F0") not in parts


def test_folding_leaves_no_symbol_of_what_is_fixed(tmp_path: Path) -> None:
    system = reduced(scene_of(tmp_path, CLASS_A.replace("[drives]\n", "")))
    contact = system.contacts[0]
    names = {str(s).strip("_") for e in (*system.acceleration, contact.slip, contact.capacity) for s in e.free_symbols}
    assert names == {"theta", "omega"}
    assert system.all_requirements == ()


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ('title = "one disc"', 'titel = "one disc"', 1, "Did you mean 'title'"),
        ('"disc_rig"', '"disk_rig"', 2, "Did you mean 'disc_rig'"),
        ('["disc0"]', '["disk0"]', 3, "Did you mean 'disc0'"),
        ('["disc0"]', '["disc0", "disc0"]', 3, "stands twice"),
        ('["disc0"]', '"disc0"', 3, "must be a list of names"),
        ('["F0"]', '[\n"F0",\n"F1"]', 6, "needs contact 'disc1', which the scene leaves out. Add 'disc1' to contacts"),
        ('["F0"]', '["theta"]', 4, "states are always shown"),
        ('["F0"]', '["enery"]', 4, "Did you mean 'energy'"),
        ("w0 =", "w1 =", 11, "needs contact 'disc1', which the scene leaves out. Add 'disc1' to contacts"),
        ("w0 =", "ww =", 11, "has no drive 'ww'"),
        ("w0 =", "J =", 11, "A parameter stands in [parameters] or [free]"),
        ("N0 =", "N1 =", 8, "needs contact 'disc1'"),
        ("N0 =", "NO =", 8, "Did you mean 'N0'"),
        ('"8 N"', '"8 Nn"', 8, "'Nn' is not a unit"),
        ('"8 N"', '"8 Newtons"', 8, "Did you mean 'newton'"),
        ('"8 N"', '"8 kg"', 8, "cannot be converted to N"),
        ('"8 N"', '"heavy"', 8, "must be a number with a unit"),
        ('"8 N"', "true", 8, "must be a number in N"),
        ('"8 N"', "nan", 8, "must be a finite number"),
        ('"8 N"', "-1", 8, "normal force of disc 0 must be >= 0"),
        ('"8 N"', '"8 N"\nmu_k0 = 0.9', 9, "mu_k0 exceeds mu_s0"),
        ('"8 N"', '"8 N"\nw0 = 1', 9, "'w0' is both fixed in [parameters] and given in [drives]"),
        ('"8 N"', '"8 N"\n[free]\nN0 = 8', 8, "'N0' is both fixed in [parameters] and given in [free]"),
        ('"5 s"', '"-5 s"', 5, "must end after it starts"),
        ('"5 s"', '"5 m"', 5, "cannot be converted to s"),
        ('stop_time = "5 s"', "", None, "'stop_time' is missing"),
        ('"0.83 rad/s"', "{ from = 1, to = 2 }", 11, "lacks 'begin'"),
        ('"0.83 rad/s"', "{ times = [2, 1], values = [0, 1] }", 11, "needs ascending times"),
        ('"0.83 rad/s"', "{ kind = 1 }", 11, "'kind' is not a key in [drives.w0]"),
        ('"0.83 rad/s"', '1\n[start]\nthta = "1 rad"', 13, "Did you mean 'theta'"),
        ('"0.83 rad/s"', '1\n[laws]\ndisc1 = "lugre"', 13, "gets a law but is left out"),
        ('"0.83 rad/s"', '1\n[laws]\ndisc0 = "lugree"', 13, "No law is called 'lugree'"),
        ('"0.83 rad/s"', '1\n[compute]\nkind = "cicle"', 13, "Did you mean 'cycle'"),
        ('"0.83 rad/s"', '1\n[compute]\nkind = "strobe"', 12, "needs either 'period', s, or 'forcing'"),
        ('"0.83 rad/s"', '1\n[compute]\nover = "N0"\nvalues = [1]', 13, "It is fixed: move it to [free]"),
        ('"0.83 rad/s"', '1\n[compute]\nover = "w0"', 12, "'over' and 'values' go together"),
        ('"0.83 rad/s"', "1\n[compute]\nsamples = 1", 13, "whole number from 2 on"),
        ('"0.83 rad/s"', "1\n[reference]\nevents = 1", 12, "double brackets"),
        ('"0.83 rad/s"', "1 rad/s", 11, "is not TOML"),
    ],
)
def test_mistakes_are_named_by_their_line(tmp_path: Path, old: str, new: str, line: int | None, said: str) -> None:
    assert old in CLASS_A
    with pytest.raises(StickslipError) as caught:
        scene_of(tmp_path, CLASS_A.replace(old, new, 1))
    assert said in str(caught.value)
    if line:
        assert f"line {line}" in str(caught.value)


def test_no_such_scene() -> None:
    with pytest.raises(StickslipError, match="Did you mean 'disc_rig_class_a'"):
        scene_of(Path("nowhere"), "") if Path("nowhere").is_dir() else _read("disc_rig_clas_a")


def _read(name: str) -> Scene:
    from fmu_models.scene.read import read_scene

    return read_scene(name)


BALL = """title = "ball"
model = "bouncing_ball"
stop_time = 1
[start]
x = "-1 mm"
v = 0
"""


def test_a_start_below_a_wall_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match=r"line 5: the start lies 0\.001 m behind the wall of contact 'table'"):
        scene_of(tmp_path, BALL)
    scene_of(tmp_path, BALL.replace('"-1 mm"', "0"))


def test_a_start_inside_a_stop_needs_the_speed_of_entry(tmp_path: Path) -> None:
    text = 'title = "inside"\nmodel = "hinge_clearance"\nstop_time = 1\n[start]\nx = 0.02\n'
    with pytest.raises(StickslipError, match=r"line 5: the start lies 0\.01 inside stop 'right'.*right_memory"):
        scene_of(tmp_path, text)
    assert scene_of(tmp_path, f"{text}right_memory = 0.1\n").start["right_memory"] == 0.1


def test_references_that_fit_nothing(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, CLASS_A + "\n[[reference]]\nperoid = 1\n")
    rows = compute(scene, Fmu.open(built_scene(scene)))
    with pytest.raises(StickslipError, match="there is no result 'peroid'"):
        compare(scene, rows)
    scene = scene_of(tmp_path, CLASS_A + "\n[[reference]]\nat = 3\nevents = 1\n")
    with pytest.raises(StickslipError, match=r"a reference is at 3.0, the scene computes at no value"):
        compare(scene, rows)


def test_a_motion_at_rest_is_no_cycle(tmp_path: Path) -> None:
    still = CLASS_A.replace('"0.83 rad/s"', "0.0") + '\n[compute]\nkind = "cycle"\n'
    scene = scene_of(tmp_path, still)
    (row,) = compute(scene, Fmu.open(built_scene(scene)))
    assert row.values["events"] == 0.0 and "period" not in row.values


def test_following_starts_where_the_last_run_ended(tmp_path: Path) -> None:
    text = CLASS_A + '\n[compute]\nover = "w0"\nvalues = [0.83, 0.83]\n'
    alone = compute(scene := scene_of(tmp_path, text), Fmu.open(built_scene(scene)))
    following = compute(scene := scene_of(tmp_path, text + "follow = true\n"), Fmu.open(built_scene(scene)))
    assert alone[0].values == alone[1].values
    assert following[1].trajectory is not None and following[0].trajectory is not None
    assert following[1].trajectory["theta"][0] == following[0].trajectory["theta"][-1]


def test_elastic_impacts_do_not_seem_to_raise_an_energy_that_is_not_shown(tmp_path: Path) -> None:
    text = 'title = "elastic"\nmodel = "fermi_accelerator"\noutputs = []\nstop_time = 300\n[parameters]\ne = 1\nA = 0\n'
    scene = scene_of(tmp_path, text)
    run = simulate(Fmu.open(built_scene(scene)), **arguments(scene))
    assert run.impacts and not run.gains and np.isfinite(run["v"]).all()


CHART = """title = "periods"
model = "discontinuous_support"
stop_time = 1
[free]
omega = 1.1
f0 = 0.5
[compute]
kind = "chart"
forcing = "omega"
what = "period"
[compute.axes]
omega = { from = "60 deg/s", to = 1.5, count = 3 }
f0 = [0.1, 0.2]
"""


def test_a_family_of_a_scene_is_kept_whole(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, CHART)
    assert scene.compute.axes["omega"] == pytest.approx((math.pi / 3, (math.pi / 3 + 1.5) / 2, 1.5), rel=1e-15)
    of_two = scene_of(tmp_path, CHART.replace("count = 3", "count = 2"))
    assert of_two.compute.axes["omega"] == (math.radians(60.0), 1.5)
    assert scene.compute.settings == {"what": "period"} and scene.compute.axes["f0"] == (0.1, 0.2)
    assert Scene.from_json(scene.to_json()) == scene


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ('"chart"', '"basins"', 10, "'what' is not a key in"),
        ('"chart"\nforcing = "omega"\nwhat = "period"', '"section"\nforcing = "omega"', 10, "'axes' is not a key in"),
        ("f0 = [0.1, 0.2]\n", "", 11, "a chart needs axes over two free parameters or drives"),
        ("f0 = [0.1, 0.2]", "g = [0.1, 0.2]", 13, "'g' is neither a drive nor free. It is fixed"),
        ("[0.1, 0.2]", "0.1", 13, "must be a list of values, or { from"),
        ("count = 3", "count = 1", 12, "'count' must be a whole number from 2 on, found 1"),
        (", count = 3", "", 12, "'count' is missing of the range 'omega'"),
        ("count = 3", "count = 3, by = 1", 12, "'by' is not a part of the range 'omega'"),
        ('"period"', "1", 10, "'what' must be a text"),
        ('forcing = "omega"', "", 7, "needs either 'period', s, or 'forcing'"),
        ('forcing = "omega"', "level = { y = 1 }", 9, "has no state 'y'"),
        ('forcing = "omega"', 'impacts = "stop"', 9, "has no contact 'stop'"),
        ('forcing = "omega"', 'level = { x = 0 }\nimpacts = "support"', 7, "name one of them"),
    ],
)
def test_a_mistake_in_a_family_is_named_by_its_line(tmp_path: Path, old: str, new: str, line: int, said: str) -> None:
    assert old in CHART
    with pytest.raises(StickslipError, match=rf"line {line}: .*{re.escape(said)}"):
        scene_of(tmp_path, CHART.replace(old, new))


MAP = """
title = "Henon"
model = "henon"
stop_time = 400

[parameters]
a = 0.3

[compute]
kind = "lyapunov"

[[reference]]
source = "its determinant is -b"
exponent1 = "log(b)/2"
tolerance = 0.2
"""


def test_a_scene_of_a_map_computes_every_step_and_knows_formulas(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, MAP)
    (reference,) = scene.references
    assert scene.of_map and reference.source and reference.values == {"exponent1": pytest.approx(math.log(0.3) / 2)}
    assert Scene.from_json(scene.to_json()) == scene
    (row,) = compute(scene, Fmu.open(built_scene(scene)))
    assert row.values["exponent1"] + row.values["exponent2"] == pytest.approx(math.log(0.3), rel=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"lyapunov"', '"cycle"', "line 10: a cycle is of a motion in time, which a map has none of. Choose a kind: "),
        ('"lyapunov"', '"orbit"\nlevel = { x = 0 }', "line 9: a orbit is of a motion seen once per step"),
        ('"lyapunov"', '"lyapunov"\nperiod = 1', "line 11: of a map every step is looked at: leave the period out"),
        ("log(b)/2", "log(c)/2", "line 14: 'c' in 'log(c)/2' has no value"),
        ("log(b)/2", "log(-b)", "line 14: 'exponent1' must be a finite number"),
    ],
)
def test_a_mistake_in_a_scene_of_a_map_is_named_by_its_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(StickslipError, match=re.escape(said)):
        scene_of(tmp_path, MAP.replace(old, new))


def test_a_frequency_counts_periods_unless_it_is_an_angular_one(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, CHART)
    assert period(scene, {"omega": 4.0}) == pytest.approx(math.pi / 2)  # rad/s
    counted = dataclasses.replace(scene, compute=Compute(kind="strobe", forcing="omega"))
    assert period(counted, {"omega": 4.0}) == 0.25


def test_an_orbit_is_of_a_strobe(tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match="leave 'level' and 'impacts' out"):
        scene_of(tmp_path, CHART[: CHART.index("kind")] + 'kind = "orbit"\nlevel = { x = 0 }\n')


PANELS = """title = "panels"
model = "disc_rig"
contacts = ["disc0"]
outputs = []
stop_time = "2 s"

[free]
N0 = "8 N"

[drives]
w0 = "0.83 rad/s"

[compute]
kind = "trajectory"
over = "w0"
values = [0.2, 0.4]
panels = { N0 = [8, "0.01 kN"] }

[[reference]]
panel = 10
at = 0.4
theta = %s
"""


def test_panels_are_the_scene_at_each_of_their_values(tmp_path: Path) -> None:
    """Against the scene without them, at either value."""
    scene = scene_of(tmp_path, PANELS % "1")
    rows = compute(scene, Fmu.open(built_scene(scene)))
    assert [(row.panel, row.at) for row in rows] == [(8.0, 0.2), (8.0, 0.4), (10.0, 0.2), (10.0, 0.4)]
    for k, force in enumerate((8, 10)):
        text = PANELS.replace('panels = { N0 = [8, "0.01 kN"] }\n', "").replace('N0 = "8 N"', f"N0 = {force}")
        alone = scene_of(tmp_path, text.partition("[[reference]]")[0], f"at_{force}")
        expected = compute(alone, Fmu.open(built_scene(alone)))
        assert [row.values for row in rows[2 * k : 2 * k + 2]] == [row.values for row in expected]
    (comparison,) = compare(scene, rows)
    assert (comparison.panel, comparison.found) == (10.0, rows[3].values["theta"])
    with pytest.raises(StickslipError, match=r"in panel 9\.0; panels are 8, 10"):
        compare(scene_of(tmp_path, (PANELS % "1").replace("panel = 10", "panel = 9")), rows)
    for wrong, said in (("{ w0 = [1] }", "not varied already"), ("{ N1 = [1] }", "neither a drive nor free")):
        with pytest.raises(StickslipError, match=said):
            scene_of(tmp_path, (PANELS % "1").replace('{ N0 = [8, "0.01 kN"] }', wrong))
