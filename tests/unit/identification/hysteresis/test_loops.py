"""Forces with memory from loops: against closed forms, loops emulated by other means, and logs of other rigs."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from emulated_loop import growing, noisy, of_bouc_wen, of_dahl, of_sliders
from typer.testing import CliRunner
from whole_application import app

from fmu_models import Hysteresis, Signal, load, simulate
from fmu_models.base.errors import StickslipError
from identification import LoopLog, identify_hysteresis, read_loop
from identification.hysteresis.laws import LAWS
from identification.hysteresis.read import conditions_of
from identification.hysteresis.result import cycles_of
from identification.hysteresis.spectrum import fit_sliders

LOGS = Path(__file__).parents[4].parent / "shared" / "data" / "hysteresis"


def log_of(name: str, **how: object) -> LoopLog:
    """A log of somebody's rig."""
    if not (LOGS / name).exists():
        pytest.skip(f"'{LOGS / name}' is not here: the project ships no logs of others")
    return read_loop(LOGS / name, **how)  # type: ignore[arg-type]


def written(path: Path, columns: dict[str, np.ndarray], *, header: bool = True) -> Path:
    """A CSV file."""
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns) if header else "",
               comments="")  # fmt: skip
    return path


@pytest.fixture(scope="module")
def loop() -> tuple[np.ndarray, np.ndarray]:
    """A way and the force of two sliders."""
    way = growing()
    return way, of_sliders(way, [3.0, 1.0], [0.1, 0.5])


@pytest.mark.parametrize(
    ("heads", "header"),
    [
        (("Displacement [mm]", "Force [kN]"), True),
        (("time", "x", "f"), True),
        (("a", "b"), False),
        (("a", "b", "c"), False),
        (("a", "b", "c", "d"), False),
    ],
)
def test_columns_are_known_by_names_or_by_their_number(tmp_path, loop, heads, header) -> None:
    way, force = loop
    time = np.arange(len(way)) * 0.01
    values = {2: [way, force], 3: [time, way, force], 4: [time, way, np.gradient(way, time), force]}[len(heads)]
    log = read_loop(written(tmp_path / "loop.csv", dict(zip(heads, values, strict=True)), header=header))
    of_way, of_force = (1e-3, 1e3) if "[mm]" in heads[0] else (1.0, 1.0)
    assert log.way == pytest.approx(of_way * way)
    assert log.force == pytest.approx(of_force * force)
    assert (log.time is None) == (len(heads) == 2)
    assert any("states no units" in note for note in log.notes) == ("[mm]" not in heads[0])


def test_the_name_of_a_file_says_conditions() -> None:
    assert conditions_of("mr_25mm0x25Hz0x5A") == {"mm": 25.0, "Hz": 0.25, "A": 0.5}
    assert conditions_of("damper1") == {}


def test_a_force_the_other_way_round_is_turned_and_exchanged_columns_are_refused(tmp_path, loop) -> None:
    way, force = loop
    turned = read_loop(written(tmp_path / "turned.csv", {"x": way, "force": -force}))
    assert turned.force == pytest.approx(force)
    assert any("its sign was turned" in note for note in turned.notes)
    with pytest.raises(StickslipError, match="their columns are swapped"):
        read_loop(written(tmp_path / "swapped.csv", {"x": force, "force": way}))
    both = read_loop(written(tmp_path / "both.csv", {"x": force, "force": -way}))
    assert any("Are the columns swapped" in note for note in both.notes)


def test_a_log_that_was_read_is_checked_once(tmp_path, loop, monkeypatch) -> None:
    way, force = loop
    log = read_loop(written(tmp_path / "loop.csv", {"x": way, "force": force}))
    assert log.checked and not replace(log, force=-force).checked
    monkeypatch.setattr("identification.hysteresis.read.fit_sliders", None)
    identify_hysteresis(log, laws=[])
    with pytest.raises(TypeError):
        identify_hysteresis(replace(log, force=-force), laws=[])


def test_a_load_that_is_none_is_said_and_left_out(tmp_path, loop) -> None:
    way, force = loop
    pulled = {"x": way, "force": force, "normal": np.sin(np.arange(len(way)))}
    assert any("changes its sign" in note for note in read_loop(written(tmp_path / "pulled.csv", pulled)).notes)
    none = written(tmp_path / "none.csv", {**pulled, "normal": np.zeros(len(way))})
    with pytest.raises(StickslipError, match="--column load="):
        read_loop(none)
    assert read_loop(none, columns={"load": ""}).load is None


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"x": np.arange(30.0), "y": np.arange(30.0)}, "no column is known as the force; there are x, y"),
        ({"x": np.ones(30), "force": np.arange(30.0)}, "its way never changes"),
        ({"x": np.arange(30.0), "force": np.arange(30.0)}, "its way goes over 29 m; .* such as --unit way=mm"),
        ({"x": np.arange(5.0), "force": np.arange(5.0)}, "5 rows hold numbers"),
        ({"time": np.zeros(30), "x": np.arange(30.0) % 3, "force": np.arange(30.0) % 7}, "run back or stand still"),
    ],
)
def test_what_is_no_loop_is_said(tmp_path, columns, said) -> None:
    with pytest.raises(StickslipError, match=said):
        read_loop(written(tmp_path / "bad.csv", columns))


def test_what_a_log_does_not_tell_is_said_once_in_the_notes_of_its_law() -> None:
    """One amplitude does not tell the knees of four sliders; pytest makes an error of a warning."""
    way = 0.2 * np.sin(np.linspace(0.0, 12 * np.pi, 1200))
    fit = identify_hysteresis(LoopLog("one", way, of_dahl(way, 30.0, 1.0)), laws=["MaxwellSlip-2"])
    notes = [note for law in fit.laws for note in law.notes]
    assert len(set(notes)) == len(notes)


def test_few_samples_a_cycle_are_told(tmp_path) -> None:
    way = growing(120)
    log = read_loop(written(tmp_path / "coarse.csv", {"x": way, "force": of_dahl(way, 30.0, 1.0)}))
    assert any("samples a cycle, which miss peaks" in note for note in log.notes)
    fit = identify_hysteresis(LoopLog("coarse", way, of_dahl(way, 30.0, 1.0)), laws=[])
    assert any("samples a cycle, which miss peaks" in note for note in fit.notes)


def test_one_slider_takes_what_its_closed_form_says() -> None:
    """4 k D (a - D) a cycle, k D/a between the ends of the loop."""
    way = 0.7 * np.sin(np.linspace(0.0, 12 * np.pi, 6001))
    (cycle,) = cycles_of(LoopLog("slider", way, of_sliders(way, [5.0], [0.2])))
    assert cycle.amplitude == pytest.approx(0.7, rel=1e-5)
    assert cycle.work == pytest.approx(4 * 5.0 * 0.2 * 0.5, rel=1e-4)  # by trapezia of 500 samples
    assert cycle.stiffness == pytest.approx(5.0 * 0.2 / 0.7, rel=1e-5)
    assert cycle.damping_ratio == pytest.approx(2.0 / (2 * np.pi * (1.0 / 0.7) * 0.49), rel=1e-4)


def test_sliders_come_out_of_a_loop_without_start_values(loop) -> None:
    """Bounds of 30 sliders are a factor 1.21 apart: the force is told to parts of that."""
    spectrum = fit_sliders([LoopLog("two", *loop)])
    assert spectrum.left(LoopLog("two", *loop)) < 0.02
    assert spectrum.stiffness_at_rest() == pytest.approx(4.0, rel=0.03)
    assert spectrum.sliding_force() == pytest.approx(0.8, rel=0.02)
    way, force = spectrum.backbone()
    assert force == pytest.approx(3.0 * np.minimum(way, 0.1) + np.minimum(way, 0.5), abs=0.02)
    assert not spectrum.is_rigid()
    still = fit_sliders([LoopLog("rigid", loop[0], np.sign(np.gradient(loop[0])))])
    assert still.is_rigid()


def test_a_load_scales_the_force_and_is_missed_where_it_is_ignored(loop) -> None:
    way, force = loop
    load = 1.0 + 0.5 * np.sin(np.linspace(0, 17, len(way)))
    fit = identify_hysteresis(LoopLog("pressed", way, load * force, load=load), laws=[])
    assert fit.left["pressed"] < 0.02
    # it begins at rest, without force, so that all of it is taken
    assert np.array_equal(fit.logs[0].way, way)
    assert not any("a memory that nobody knows" in note for note in fit.notes)
    (note,) = (note for note in fit.notes if "in proportion to its load" in note)
    assert float(note.rsplit(" % where the load is ignored", 1)[0].rsplit(" ", 1)[1]) > 10


def test_noise_of_the_way_is_smoothed_before_it_takes_from_the_stiffness() -> None:
    way = growing(4000)
    log = noisy(way, of_dahl(way, 30.0, 1.0), 1, of_way=0.005)
    plain, smooth = (fit_sliders([one]).backbone()[1][10] for one in (log, log.smooth()))
    truth = 1 - np.exp(-30.0 * way.max() / 10)
    assert abs(smooth - truth) < abs(plain - truth)
    # a twelfth of a cycle, an odd number: 13 stretches of the way lie between its turns and its ends
    over = int(log.smooth().notes[-1].split("smoothed over ")[1].split()[0])
    assert over % 2 == 1 and abs(over - 2 * 4000 / 13 / 12) <= 1


SYNTHETIC = {
    "MaxwellSlip-2": (of_sliders, ([3.0, 1.0], [0.1, 0.5]), {"k_1": 3.0, "D_1": 0.1, "k_2": 1.0, "D_2": 0.5}),
    "Dahl": (of_dahl, (12.0, 0.8), {"sigma": 12.0, "F_c": 0.8}),
    "BoucWen-1": (of_bouc_wen, (4.0, 3.0, 1.0, 1), {"k": 4.0, "beta": 3.0, "gamma": 1.0}),
    "BoucWen-2": (of_bouc_wen, (4.0, 9.0, -2.0, 2), {"k": 4.0, "beta": 9.0, "gamma": -2.0}),
}


@pytest.mark.nightly_for("BoucWen-2", "BoucWen-1", "MaxwellSlip-2")
@pytest.mark.parametrize("law", SYNTHETIC)
def test_a_law_is_found_from_its_own_loop(law: str) -> None:
    """With noise of 1 % of the force: within four deviations; and the law is a law of a mechanism again."""
    forces, arguments, truth = SYNTHETIC[law]
    way = growing()
    log = noisy(way, forces(way, *arguments), 5, of_force=0.01)
    fit = identify_hysteresis(log, laws=[law])
    (fitted,) = fit.laws
    assert fitted.worst < 0.05
    for one in fitted.parameters:
        if one.name in truth:
            assert one.standard_deviation is not None
            assert abs(one.value - truth[one.name]) < 4 * one.standard_deviation
            assert one.standard_deviation < 0.1 * abs(truth[one.name])
    time = np.arange(len(way), dtype=float)
    run = simulate(load(fit.model()), time[-1], parameters=fit.best.model_values,
                   inputs={"way": Signal(time, way)}, output_times=time)  # fmt: skip
    assert np.std(run["force"] - forces(way, *arguments)) < 0.02
    assert Hysteresis(name="joint", way=_way(), law=fit.law()).law == LAWS[law].at(fit.best.values)


def _way():
    from fmu_models import Coordinate

    return Coordinate("x", "m", "way")


def test_a_log_that_begins_in_the_middle_is_cut_at_its_far_turn() -> None:
    way = np.sin(np.linspace(0.0, 12 * np.pi, 1200))
    log = LoopLog("cut", way[300:], of_sliders(way, [3.0, 1.0], [0.1, 0.5])[300:])
    fit = identify_hysteresis(log, laws=["MaxwellSlip-2"])
    assert fit.logs[0].turned
    assert np.array_equal(fit.logs[0].way, way[300 + np.argmin(way[300:400]) :])
    assert any("begins with a memory that nobody knows" in note for note in fit.notes)
    values = fit.best.values
    assert [values[n] for n in ("k_1", "D_1", "k_2", "D_2")] == pytest.approx([3.0, 0.1, 1.0, 0.5], rel=0.02)


@pytest.mark.nightly
def test_intervals_hold_what_they_say() -> None:
    """95 % intervals of 40 loops with noise of .1 % of the way and 1 % of the force hold the truth in 90 to 99 %."""
    way = growing()
    inside = []
    for seed in range(40):
        log = noisy(way, of_sliders(way, [3.0, 1.0], [0.1, 0.5]), seed, of_way=0.001, of_force=0.01)
        fitted = identify_hysteresis(log, laws=["MaxwellSlip-2"]).best
        assert fitted.calibration is not None
        for name, value in SYNTHETIC["MaxwellSlip-2"][2].items():
            low, high = fitted.calibration.interval(name)
            inside.append(low <= value <= high)
    assert 0.9 <= np.mean(inside) <= 0.995


def test_the_tribometer_is_told_by_its_normal_force() -> None:
    """Half of it on the other half: 5.5 % asked; without the normal force more than twice as much."""
    log = log_of("tribometer_loops.txt")
    half = len(log.way) // 2
    first, second = log.part(0, half), log.part(half, None).from_largest()
    assert fit_sliders([first], rate=False).left(second) < 0.055
    assert fit_sliders([second], rate=False).left(first) < 0.055


@pytest.mark.nightly
def test_a_column_of_concrete_is_pinched() -> None:
    """Gill's RC column: 10.37 % by the 15 published parameters; 10.5 % from start values of the command's own."""
    fit = identify_hysteresis(log_of("gill.mat"), laws=["BoucWenBaberNoori"])
    assert fit.best.worst < 0.105


@pytest.mark.parametrize("lag", [0.0, 0.05])
def test_a_voltage_whose_lag_nobody_says_is_followed(tmp_path, lag: float) -> None:
    """A square wave of voltage; what follows it is stepped in parts of each sample, by RK4's like of order one."""
    way, time = 0.3 * growing(4000, 24), np.arange(4000) * 0.005
    voltage = 2.0 * (np.sin(3.1 * time) > 0.2) + 0.5
    followed = [voltage[0]]
    for before, after in pairwise(voltage):
        u = followed[-1]
        for part in np.arange(0.5, 200) / 200:
            u += (before + part * (after - before) - u) * 0.005 / 200 / lag if lag else 0.0
        followed.append(u if lag else after)
    force = of_sliders(way, [3.0, 1.0], [0.03, 0.1]) * (0.4 + np.array(followed))
    force += 1e-3 * np.random.default_rng(2).normal(size=len(force))
    columns = {"time": time, "x": way, "f": force, "Voltage [V]": voltage}
    fit = identify_hysteresis(written(tmp_path / "damper.csv", columns), laws=[], factors=["Voltage"], rate=False)
    assert fit.left["damper.csv"] < 0.04
    assert fit.lag == pytest.approx(lag, rel=0.05, abs=0.005)
    assert any("with a lag of" in note for note in fit.notes)
    plain = identify_hysteresis(tmp_path / "damper.csv", laws=[], rate=False)
    assert plain.left["damper.csv"] > 0.2
    assert not any("backlash" in note for note in fit.notes)
    with pytest.raises(StickslipError, match="has no column 'current'"):
        identify_hysteresis(tmp_path / "damper.csv", laws=[], factors=["current"])


def test_dampers_of_several_currents_are_told_together() -> None:
    """10 % of all of them asked in sample."""
    names = ["10mm1Hz0x5A", "10mm1Hz1A", "25mm0x25Hz0A", "25mm0x25Hz0x5A", "25mm0x25Hz1A", "25mm0x5Hz1A", "5mm3Hz1A"]
    logs = [log_of(f"mr_{name}.txt", units={"way": "mm"}).smooth().from_largest() for name in names]
    spectrum = fit_sliders(logs, factors=["A"])
    pooled = np.concatenate([log.force - spectrum.force(log) for log in logs])
    assert np.std(pooled) / np.std(np.concatenate([log.force for log in logs])) < 0.10
    unseen = fit_sliders([log for log in logs if log.conditions["mm"] != 5.0], factors=["A"])
    assert unseen.left(logs[-1]) < 0.13


@pytest.mark.nightly
def test_the_command_says_it_writes_it_and_refuses(tmp_path, loop) -> None:
    path = written(tmp_path / "loop_5mm.csv", {"x": loop[0], "force": loop[1]})
    runner, files = CliRunner(), [str(tmp_path / name) for name in ("fit.json", "fit.svg", "law.fmu")]
    asked = [str(path), "--laws", "MaxwellSlip-2", "-o", files[0], "--figure", files[1], "--fmu", files[2], "--json"]
    done = runner.invoke(app, ["hysteresis", *asked])
    assert done.exit_code == 0, done.output
    said = json.loads(Path(files[0]).read_text("utf-8"))
    assert said["laws"][0]["left"]["loop_5mm.csv"] < 0.01
    assert said["stiffness"] == pytest.approx(4.0, rel=0.03)
    assert Path(files[1]).stat().st_size > 10_000
    values = {one["name"]: one["value"] for one in said["laws"][0]["parameters"]}
    assert float(str(load(files[2]).variables["k_1"].start)) == pytest.approx(values["k_1"])
    again = runner.invoke(app, ["hysteresis", str(path), "--laws", "Dahll"])
    assert isinstance(again.exception, StickslipError)
    assert "Dahl" in str(again.exception)


@pytest.fixture(scope="module")
def slack(loop) -> LoopLog:
    """The two sliders behind a backlash, with noise of 1e-3 of the force."""
    way, _ = loop
    played = way - of_sliders(way, [1.0], [0.15])
    return noisy(way, of_sliders(played, [3.0, 1.0], [0.1, 0.5]), 5, of_force=1e-3)


def test_a_backlash_that_sliders_cannot_have_is_said(loop, slack) -> None:
    notes = identify_hysteresis(slack, laws=[]).notes
    assert any("shows a backlash of about 0.3 m" in note for note in notes)
    way, force = loop
    assert not any(
        "backlash" in note for note in identify_hysteresis(noisy(way, force, 5, of_force=1e-3), laws=[]).notes
    )


@pytest.mark.nightly
def test_a_law_behind_a_backlash_is_found(slack) -> None:
    """Width to 1e-3, springs and bounds to 1 %, from no start values."""
    fit = identify_hysteresis(slack, laws=["Play-MaxwellSlip-2"])
    values = fit.best.values
    assert values["w"] == pytest.approx(0.15, abs=1e-3)
    pairs = sorted((values[f"D_{i}"], values[f"k_{i}"]) for i in (1, 2))
    assert pairs == [pytest.approx((0.1, 3.0), rel=0.01), pytest.approx((0.5, 1.0), rel=0.01)]
    assert fit.law().w == pytest.approx(0.15, abs=1e-3)  # type: ignore[attr-defined]


def test_loops_that_do_not_close_are_said(loop) -> None:
    way, force = loop
    drifting = noisy(way, force + np.linspace(0.0, 0.2, len(way)), 6, of_force=1e-3)
    said = [note for note in identify_hysteresis(drifting, laws=[]).notes if "do not close" in note]
    assert len(said) == 1 and "by 0.1" in said[0]
    for seed in range(4):
        notes = identify_hysteresis(noisy(way, force, seed, of_force=0.02), laws=[]).notes
        assert not any("close" in note for note in notes)


@pytest.mark.parametrize("lost", [0.0, 0.4])
def test_loops_that_lose_their_height_are_said(loop, lost: float) -> None:
    """At one amplitude; and not where amplitudes alone differ, as those of a hardening spring do."""
    way = np.sin(np.linspace(0.0, 24 * np.pi, 2400))
    force = of_dahl(way, 12.0, 0.8) * np.linspace(1.0, 1.0 - lost, len(way))
    notes = identify_hysteresis(noisy(way, force, 3, of_force=0.01), laws=[]).notes
    assert any("weakens by 3" in note or "weakens by 4" in note for note in notes) == bool(lost)
    hard, _ = loop
    notes = identify_hysteresis(noisy(hard, hard + 3 * hard**3, 3, of_force=0.01), laws=[]).notes
    assert not any("damage does" in note for note in notes)
    assert any("spring beside that stiffens" in note for note in notes)
