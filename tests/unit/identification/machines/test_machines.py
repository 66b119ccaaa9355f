"""Machines of several joints: the regressor against equations typed by hand and against Newton and Euler's recursion,
base parameters, values of an emulated arm, and what is refused."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy
from checkout import ROOT
from emulated_arm import ARM, log, torques
from scipy.signal import welch
from typer.testing import CliRunner
from whole_application import app

from fmu_models import Coordinate, Input, KelvinVoigt, Mechanism, Parameter, StickslipError, Stop
from fmu_models.oscillators import load
from identification.machines.inverse import identify_machine
from identification.machines.machine_fit import MachineFit
from identification.machines.motion import MachineLog
from identification.machines.predicted import predict_efforts
from identification.machines.prefilter import Band, prefilter
from identification.machines.read import read_machine_log
from identification.machines.regressor import base_parameters, regressor_of
from identification.report.machine_figures import machine_fit_figure

pytestmark = pytest.mark.digits

DATA = ROOT / "data" / "machines"
KNOWN = {"g": ARM["g"], "l1": ARM["l1"]}
RNG = np.random.default_rng(4)


@pytest.fixture(scope="module")
def arm() -> Mechanism:
    return load(DATA / "two_link_arm.py")


@pytest.fixture(scope="module")
def fit(arm: Mechanism) -> MachineFit:
    return identify_machine(arm, [log(1), log(2)], known=KNOWN, held_out=[log(3)])


def test_the_regressor_is_lagranges_equations(arm: Mechanism):
    regressor = regressor_of(arm, KNOWN)
    q, v, a = RNG.normal(size=(3, 40, 2))
    assert regressor(q, v, a) @ regressor.declared == pytest.approx(torques(q, v, a), abs=1e-13)
    assert (regressor.joints, regressor.efforts) == (("q1", "q2"), ("tau1", "tau2"))
    assert dict(zip(regressor.names, regressor.units, strict=True))["m2 r2"] == "kg m"


def skew(x: np.ndarray) -> np.ndarray:
    return np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])


OFFSETS = [(0.1 * i - 0.2, 0.05 * i, 0.3 - 0.02 * i) for i in range(7)]  # m, of a joint from the one before
AXES = [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0)]


def chain(links: int) -> Mechanism:
    """A spatial chain: each link with mass, first moments and a full inertia about its joint."""
    coordinates = [Coordinate(f"q{i}", "rad", f"joint {i}") for i in range(links)]
    kinetic, potential, base = sympy.S.Zero, sympy.S.Zero, sympy.zeros(3, 1)
    w, v, down = base, base, sympy.Matrix([0, 0, -9.81])
    height = sympy.S.Zero
    drives = {}
    for i, q in enumerate(coordinates):
        axis = sympy.Matrix(AXES[i])
        turn = turned(AXES[i], q).T
        offset = sympy.Matrix(OFFSETS[i])
        height = height - down.dot(offset)
        v, w, down = turn * (v + w.cross(offset)), turn * w + axis * q.v, turn * down
        m = Parameter(f"m{i}", 1.0 + 0.1 * i, "kg", "mass")
        moments = sympy.Matrix([Parameter(f"s{i}{c}", 0.02 * (1 + i), "kg m", "first moment") for c in "xyz"])
        terms = {
            f"{a}{b}": Parameter(f"J{i}{a}{b}", 0.1 if a == b else 0.01, "kg m2", "")
            for a, b in ("xx", "yy", "zz", "xy", "xz", "yz")
        }
        inertia = sympy.Matrix([[terms["".join(sorted(r + c))] for c in "xyz"] for r in "xyz"])
        kinetic += (m * v.dot(v) + w.dot(inertia * w)) / 2 + moments.dot(v.cross(w))
        potential += m * height - down.dot(moments)
        drives[q] = Input(f"tau{i}", 0.0, "N m", "torque")
    return Mechanism(
        name="chain", title="chain", source="", coordinates=coordinates, kinetic_energy=kinetic,
        potential_energy=potential, applied=drives,
    )  # fmt: skip


def turned(axis: tuple[int, int, int], q: sympy.Expr) -> sympy.Matrix:
    """Rotation about an axis of the coordinates."""
    k = sympy.Matrix(3, 3, [0, -axis[2], axis[1], axis[2], 0, -axis[0], -axis[1], axis[0], 0])
    return sympy.eye(3) + sympy.sin(q) * k + (1 - sympy.cos(q)) * k * k


def newton_euler(links: int, values: Mapping[str, float], q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Torques (links,) by the recursion of Newton and Euler, link by link, in the frames of the links."""
    w, dw, acceleration = np.zeros(3), np.zeros(3), np.array([0.0, 0.0, 9.81])
    turns, wrenches = [], []
    for i in range(links):
        axis, offset = np.array(AXES[i], float), np.array(OFFSETS[i])
        turn = np.eye(3) + np.sin(q[i]) * skew(axis) + (1 - np.cos(q[i])) * skew(axis) @ skew(axis)
        at = acceleration + np.cross(dw, offset) + np.cross(w, np.cross(w, offset))
        w, dw = turn.T @ w, turn.T @ dw
        dw = dw + axis * a[i] + np.cross(w, axis * v[i])
        w = w + axis * v[i]
        acceleration = turn.T @ at
        m, s = values[f"m{i}"], np.array([values[f"s{i}{c}"] for c in "xyz"])
        J = np.array([[values[f"J{i}" + "".join(sorted(r + c))] for c in "xyz"] for r in "xyz"])
        force = m * acceleration + np.cross(dw, s) + np.cross(w, np.cross(w, s))
        wrenches.append((force, J @ dw + np.cross(w, J @ w) + np.cross(s, acceleration)))
        turns.append(turn)
    found, force, moment = np.zeros(links), np.zeros(3), np.zeros(3)
    for i in reversed(range(links)):
        force, moment = force + wrenches[i][0], moment + wrenches[i][1]
        found[i] = moment @ np.array(AXES[i], float)
        force, moment = turns[i] @ force, turns[i] @ moment
        moment = moment + np.cross(np.array(OFFSETS[i]), force)
    return found


def test_a_spatial_chain_agrees_with_newton_and_euler():
    links = 4
    regressor = regressor_of(chain(links))
    values = {p: 0.3 + 0.7 * np.sin(i) for i, p in enumerate(regressor.names)}
    q, v, a = RNG.normal(size=(3, 10, links))
    ours = regressor(q, v, a) @ np.array([values[name] for name in regressor.names])
    known = defaultdict(float, values)
    for row in range(10):
        assert ours[row] == pytest.approx(newton_euler(links, known, q[row], v[row], a[row]), abs=1e-10)


def test_base_parameters_take_up_what_goes_with_them(arm: Mechanism):
    base = base_parameters(regressor_of(arm, KNOWN))
    assert [one.combination for one in base.parameters] == [
        *("J1 + 0.09 m2", "J2", "m1 r1 + 0.3 m2", "m2 r2", "b1", "b2", "f1", "f2")
    ]
    assert [one.name for one in base.parameters if one.frictional] == ["b1", "b2", "f1", "f2"]


def test_the_arm_is_found_again(fit: MachineFit):
    p = ARM
    true = {"J1": p["J1"] + p["l1"] ** 2 * p["m2"], "J2": p["J2"], "m1 r1": p["m1"] * p["r1"] + p["l1"] * p["m2"]}
    true |= {"m2 r2": p["m2"] * p["r2"], **{name: p[name] for name in ("b1", "b2", "f1", "f2")}}
    for one in fit.parameters:
        assert one.value == pytest.approx(true[one.name], rel=0.05 if one.frictional else 0.01)
        assert abs(one.value - true[one.name]) < 4 * one.standard_deviation
    behind = fit.identified
    assert behind is not None
    # those who leave a log out begin from the same equations
    every = np.ones(len(behind.rows.effort), dtype=bool)
    assert behind.from_rows(every) == pytest.approx([one.value for one in fit.parameters], rel=1e-10)
    for joint in fit.joints:
        assert next(iter(joint.held_out.values())).relative_error < 0.03
        assert joint.left_out.relative_error < 1.3 * joint.seen.relative_error
        assert joint.free_run is not None and joint.free_run < 0.05


def test_the_ends_of_a_log_are_predicted_as_well_as_its_middle(arm: Mechanism, fit: MachineFit):
    """Filters without a past would show there."""
    for piece in predict_efforts(arm, fit, [log(1), log(2)]):
        off = np.abs(piece.measured - piece.modelled)
        assert np.all(off[-20:].max(axis=0) < 1.2 * off[20:-20].max(axis=0))
        assert np.all(off[:20].max(axis=0) < 1.2 * off[20:-20].max(axis=0))


def test_the_figure_shows_efforts_and_residuals_of_each_joint(arm: Mechanism, fit: MachineFit):
    whole, gap = log(1), (log(1).time < 4) | (log(1).time > 6)
    parts = replace(whole, time=whole.time[gap], position=whole.position[gap], effort=whole.effort[gap])
    seen, held_out = predict_efforts(arm, fit, [parts, log(2)]), predict_efforts(arm, fit, [log(3)])
    figure = machine_fit_figure(arm, fit, seen, held_out)
    above, below = figure.axes[:2]
    friction = "friction: effort less the rest (N m)"
    assert [axes.get_ylabel() for axes in figure.axes] == [*["effort (N m)", "residual (N m)"] * 2, friction, friction]
    assert figure.axes[3].get_xlabel() == "time, logs one after another (s)"
    measured, model = above.lines
    assert measured.get_linestyle() != model.get_linestyle()
    time, effort = (np.asarray(one, float) for one in measured.get_data())
    middle = np.searchsorted(time[:400], 2.0)
    # the low-pass of 10 Hz leaves what the arm's torque is by hand, but for friction that turns
    assert effort[middle] == pytest.approx(np.interp(seen[0].time[middle], whole.time, whole.effort[:, 0]), abs=0.1)
    residual = np.asarray(below.lines[0].get_ydata(), float)
    assert np.array_equal(residual, effort - np.asarray(model.get_ydata(), float), equal_nan=True)
    # no line crosses gaps; a log with one keeps its time
    assert np.count_nonzero(np.isnan(effort)) == 4
    assert np.nanmax(np.diff(time[~np.isnan(effort)])[:400]) == pytest.approx(seen[1].time[0] - seen[0].time[-1])
    (shade,) = above.patches
    assert shade.get_label() == "held out"


@pytest.mark.nightly
def test_noise_of_the_positions_biases_least_squares_and_not_the_instruments(arm: Mechanism):
    noisy = [noised(0.005), noised(0.03)]
    found, worse = (identify_machine(arm, logs, known=KNOWN, cutoff=25.0) for logs in noisy)
    assert any("Least squares is biased in" in said for said in found.verdicts)
    assert found["J2"].least_squares < 0.7 * ARM["J2"]
    assert found["J2"].value == pytest.approx(ARM["J2"], rel=0.01)
    assert all(found[name].value == pytest.approx(ARM[name], rel=0.05) for name in ("b1", "b2", "f1", "f2"))
    assert not any("near its turns" in said for said in found.verdicts)
    # six times the noise is too much for friction, and the cutoff that is named mends it
    (named,) = (said for said in worse.verdicts if "rest on the velocity near its turns" in said)
    cutoff = float(named.split("Lower the cutoff; ")[1].split(" Hz")[0])
    mended = identify_machine(arm, noisy[1], known=KNOWN, cutoff=cutoff)
    assert max(abs(worse[name].value / ARM[name] - 1) for name in ("b1", "b2", "f1", "f2")) > 0.1
    assert all(mended[name].value == pytest.approx(ARM[name], rel=0.1) for name in ("b1", "b2", "f1", "f2"))
    assert not any("near its turns" in said for said in mended.verdicts)


def noised(deviation: float) -> list[MachineLog]:
    """Two logs with noise (rad) on their positions."""
    rng = np.random.default_rng(8)
    return [
        replace(one, position=one.position + deviation * rng.normal(size=one.position.shape))
        for one in (log(1), log(2))
    ]


@pytest.mark.nightly
def test_a_torque_of_the_wrong_sign_or_unit_shows_in_the_weight(arm: Mechanism):
    turned = replace(log(1), effort=-log(1).effort)
    small = replace(log(1), effort=0.001 * log(1).effort)
    how = {"known": KNOWN, "method": "least squares"}
    assert any("other sign" in said for said in identify_machine(arm, [turned], **how).verdicts)
    assert any("times the declared one" in said for said in identify_machine(arm, [small], **how).verdicts)


def changed(name: str) -> MachineLog:
    one = log(1)
    if name == "still":
        return replace(one, position=one.position * [1.0, 0.0])
    if name == "back":
        return replace(one, time=np.where(np.arange(len(one.time)) == 50, 0.0, one.time))
    return replace(one, time=one.time[:150], position=one.position[:150], effort=one.effort[:150])


@pytest.mark.parametrize(
    ("name", "said"),
    [("still", "q2 never moves"), ("back", r"does not rise at 0\.196 s"), ("short", "too short for a cutoff of 2 Hz")],
)
def test_a_log_that_shows_nothing_is_refused(arm: Mechanism, name: str, said: str):
    with pytest.raises(StickslipError, match=said):
        identify_machine(arm, [changed(name)], known=KNOWN, cutoff=2.0)


def test_base_parameters_that_the_motion_leaves_open_are_named():
    """One sine shows k - w^2 J alone; with a second frequency both are there."""
    q, tau = Coordinate("q", "rad", "angle"), Input("tau", 0.0, "N m", "torque")
    J, k = Parameter("J", 1.0, "kg m2", "inertia"), Parameter("k", 2.0, "N m", "stiffness")
    swing = Mechanism(
        name="swing", title="swing", source="", coordinates=[q], applied={q: tau},
        kinetic_energy=J * q.v**2 / 2, potential_energy=k * q**2 / 2,
    )  # fmt: skip
    time = np.arange(0, 10, 0.004)
    noise = 0.01 * RNG.normal(size=len(time))
    one, other = np.sin(3 * time), np.sin(7 * time)
    single = MachineLog("one", time, one[:, None], ((2 - 9) * one + noise)[:, None])
    both = MachineLog("both", time, (one + other)[:, None], ((2 - 9) * one + (2 - 49) * other + noise)[:, None])
    (said, *_) = identify_machine(swing, [single], method="least squares").verdicts
    assert said.startswith("The logs hardly tell J, k apart (condition ")
    found = identify_machine(swing, [both], method="least squares")
    assert not any("hardly tell" in verdict for verdict in found.verdicts)
    assert [found["J"].value, found["k"].value] == pytest.approx([1.0, 2.0], rel=0.01)


def test_bounds_that_exclude_the_sign_found_are_told(arm: Mechanism):
    """A shoulder that is driven where friction should brake it: below the declared bound."""
    one = log(1)
    driven = replace(one, effort=one.effort - [[0.2, 0.0]] * np.gradient(one.position, one.time, axis=0))
    found = identify_machine(arm, [driven], known=KNOWN, method="least squares")
    assert found["b1"].value == pytest.approx(ARM["b1"] - 0.2, abs=0.01)
    assert any(
        said.startswith("b1 = -0.1")
        and "below zero, which viscous friction of the shoulder cannot be: check the signs" in said
        for said in found.verdicts
    )


def test_gaps_and_logs_of_two_rates_are_taken(arm: Mechanism):
    whole, other = log(1), log(2)
    gap = (whole.time < 4) | (whole.time > 5) | (np.arange(len(whole.time)) == 1125)  # one row alone
    parts = replace(whole, time=whole.time[gap], position=whole.position[gap], effort=whole.effort[gap])
    slow = replace(other, time=other.time[::2], position=other.position[::2], effort=other.effort[::2])
    found = identify_machine(arm, [parts, slow], known=KNOWN, method="least squares")
    assert found["m2 r2"].value == pytest.approx(ARM["m2"] * ARM["r2"], rel=0.02)


@pytest.mark.nightly
def test_a_piece_between_gaps_too_short_for_the_low_cutoff_is_left_out_of_instruments(arm: Mechanism):
    whole = log(1)
    gap = (whole.time < 6) | ((whole.time > 6.5) & (whole.time < 7.3)) | (whole.time > 7.8)
    parts = replace(whole, time=whole.time[gap], position=whole.position[gap], effort=whole.effort[gap])
    found = identify_machine(arm, [parts], known=KNOWN, cutoff=20.0)
    assert found["m2 r2"].value == pytest.approx(ARM["m2"] * ARM["r2"], rel=0.02)


def test_the_prefilter_finds_where_the_noise_of_accelerations_overtakes_and_makes_it_white():
    """Two joints of two series: white noise alone, and with twice differentiated noise of equal power at 3 Hz."""
    step, corner = 0.01, 3.0
    rng = np.random.default_rng(3)
    white, more = rng.normal(size=(2, 4, 2000))
    risen = np.gradient(np.gradient(more, step, axis=1), step, axis=1) / (2 * np.pi * corner) ** 2
    series, joint = np.repeat([0, 1, 2, 3], 2000), np.repeat([0, 1, 0, 1], 2000)
    residual = (white + np.array([0, 1, 0, 1])[:, None] * risen).ravel()
    calm = prefilter(residual, series, joint, Band(step, 1.0, 20.0))
    assert calm.corners[0] > 10 and calm.corners[1] == pytest.approx(corner, rel=0.15)
    left = calm(residual)
    for one in (1, 3):
        frequency, power = welch(left[series == one], 1 / step, nperseg=200)
        low, high = (np.mean(power[(frequency > f) & (frequency < 2 * f)]) for f in (1.0, 6.0))
        assert high == pytest.approx(low, rel=0.4)  # a factor of 100 apart before
    some, other = rng.normal(size=(2, len(series)))
    assert some @ calm(other) == pytest.approx(calm.transposed(some) @ other, rel=1e-9)


def test_what_is_not_linear_is_refused_with_its_part(arm: Mechanism):
    q = Coordinate("q", "rad", "angle")
    J, k = Parameter("J", 1.0, "kg m2", "inertia"), Parameter("k", 2.0, "1", "shape")
    tau = Input("tau", 0.0, "N m", "torque")
    common = {"name": "odd", "title": "odd", "source": "", "coordinates": [q], "applied": {q: tau}}
    bent = Mechanism(kinetic_energy=J * q.v**2 / 2, potential_energy=J * sympy.Float(3.0) * sympy.cos(k * q), **common)
    with pytest.raises(StickslipError, match=r"'cos\(q\*k\)' is not linear in k"):
        regressor_of(bent)
    stopped = Mechanism(
        kinetic_energy=J * q.v**2 / 2,
        contacts=[
            Stop(name="stop", gap=1 - q, law=KelvinVoigt(Parameter("ks", 1.0, "N m", ""), sympy.S.Zero), release="gap")
        ],
        **common,
    )
    with pytest.raises(StickslipError, match="Contact 'stop' of odd opens and closes"):
        regressor_of(stopped)
    with pytest.raises(StickslipError, match="no parameter 'gg'"):
        regressor_of(arm, {"gg": 9.8})
    free = Mechanism(**{**common, "applied": {}}, kinetic_energy=J * q.v**2 / 2)
    with pytest.raises(StickslipError, match="must hold one input of its own"):
        regressor_of(free)


def command(*arguments: str) -> dict[str, object]:
    done = CliRunner().invoke(app, ["inverse", *arguments, "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_the_command_reads_logs_by_columns(tmp_path: Path, fit: MachineFit):
    logs = [DATA / f"two_link_arm_{seed}.csv" for seed in (1, 2)]
    for n, one in enumerate(logs):
        (tmp_path / f"{n}.csv").write_text(one.read_text().replace("tau1", "shoulder", 1))
    asked = [
        str(DATA / "two_link_arm.py"),
        str(tmp_path / "0.csv"),
        "--column",
        "tau1=shoulder",
        "--method",
        "least squares",
    ]
    found = command(
        *asked, "--set", "g=9.81", "--set", "l1=0.3", "--held-out", str(tmp_path / "1.csv"), "-o", str(tmp_path / "f")
    )
    values = {one["name"]: one["value"] for one in found["parameters"]}  # type: ignore[attr-defined]
    assert values["J2"] == pytest.approx(ARM["J2"], rel=0.03)
    assert json.loads((tmp_path / "f").read_text())["machine"] == "two_link_arm"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["two_link_arm_1.csv", "--column", "tau1=t1"], "no column 't1'"),
        (["two_link_arm_1.csv", "--column", "tau9=t1"], "no coordinate or effort 'tau9'"),
        (["two_link_arm_1.csv", "--column", "tau1"], "--column takes NAME=COLUMN"),
        (["two_link_arm_1.csv", "--method", "squares"], "no method 'squares'"),
        (["two_link_arm_1.csv", "--cutoff", "200"], "does not lie between 0 and half the sampling rate"),
        (["two_link_arm_1.csv", "--figure", "a.doc"], "'a.doc' has no known format"),
        (["two_link_arm_1.csv", "--repair", "clock"], "--repair is for recipes"),
    ],
)
def test_what_the_command_cannot_do_is_said(arguments: list[str], said: str):
    asked = ["inverse", str(DATA / "two_link_arm.py"), str(DATA / arguments[0]), *arguments[1:]]
    done = CliRunner().invoke(app, asked)
    assert done.exit_code != 0 and said in f"{done.exception} {done.output}"


def test_a_column_without_numbers_is_named(tmp_path: Path, arm: Mechanism):
    one = log(1)
    rows = np.column_stack([one.time, one.position, one.effort])
    rows[50:, 4] = np.nan
    path = tmp_path / "log.csv"
    np.savetxt(path, rows, delimiter=",", header="time,q1,q2,tau1,tau2", comments="")
    with pytest.raises(StickslipError, match=r"log\.csv' holds 50 whole rows .* Column 'tau2' has 50 numbers\."):
        read_machine_log(path, arm)


def test_a_recorded_velocity_that_is_none_is_told(tmp_path: Path, arm: Mechanism):
    one = log(1)
    speed = np.gradient(one.position[:, 0], one.time)
    rows = np.column_stack([one.time, one.position, one.effort, 57.3 * speed])
    path = tmp_path / "log.csv"
    np.savetxt(path, rows, delimiter=",", header="time,q1,q2,tau1,tau2,w1", comments="")
    (note,) = read_machine_log(path, arm).notes
    assert note.startswith(f"Column 'w1' of '{path}' is not") and "0.0175 times" in note
