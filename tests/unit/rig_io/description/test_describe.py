"""What columns are, by name and content; answers, questions, and sidecars that contradict their logs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from bench_columns import SAID, bench_log, written

from fmu_models.base.errors import StickslipError
from fmu_models.simulation.measured import read_measured
from rig_io.description.answers import Answers, from_file, from_options
from rig_io.description.draft import draft, package_of, write
from rig_io.description.names import named
from rig_io.description.questions import questions
from rig_io.packages.datapackage import read_log

NAMES = {
    "time": ["Zeit", "temps (s)", "tempo", "Tiempo", "Timestamp", "t", "X_Value", "Uhrzeit", "Datum", "hora"],
    "laser": ["Laser", "Weg Laser", "distance laser", "Abstand", "Déplacement", "spostamento", "desplazamiento"],
    "angle": ["Winkel", "angle", "Angolo", "ángulo", "theta"],
    "encoder_count": ["Drehgeber Scheibe", "encoder", "codeur disque", "contatore", "Zähler"],
    "drive0_count": ["Impulse Antrieb", "motor encoder", "codeur moteur", "encoder azionamento"],
    "drive0_speed": ["Antrieb Drehzahl", "motor speed", "vitesse moteur", "velocità motore", "velocidad motor"],
    "drive1_speed": ["Antrieb 2 Drehzahl", "motor speed 2"],
    "load0": ["Normalkraft", "load cell", "force", "carico", "fuerza", "Fn", "F_N", "N(t)", "Normal", "Anpresskraft"],
    "temperature": ["Temp", "T_room", "temperature", "Temperatur", "Thermoelement 1", "PT100", "T_1"],
    "tachometer": ["Tacho", "tachymètre", "Tachometer disc"],
    "vibrometer": ["Vibrometer", "laser doppler"],
    "trigger": ["Trigger", "sync", "déclenchement"],
}


@pytest.mark.parametrize(("role", "name"), [(role, name) for role, every in NAMES.items() for name in every])
def test_names_of_five_languages_speak_for_a_role(role: str, name: str) -> None:
    found = named(name)
    assert max(found, key=lambda one: found[one]) == role


@pytest.mark.parametrize(
    "name", ["Unnamed: 0", "index", "Nr.", "comment", "Reibkraft", "friction force", "Ft", "Kommentar", "U/f"]
)
def test_other_names_speak_for_nothing(name: str) -> None:
    assert max(named(name).values(), default=0.0) < 0.6


def roles(path: Path, answers: Answers | None = None) -> dict[str, str | None]:
    return {one.name: one.role for one in draft([path], answers or Answers()).logs[0].files[0].columns}


def test_content_alone_tells_the_roles(tmp_path: Path) -> None:
    log = bench_log()
    index = np.arange(len(log["time"]), dtype=float)
    found = roles(written(tmp_path, "", [index, log["time"], log["laser"], log["encoder"], log["drive"]]))
    assert list(found.values()) == [None, "time", "laser", "encoder_count", "drive0_count"]


@pytest.mark.parametrize(
    ("unit", "role"), [("V", "laser"), ("mm", "laser"), ("deg", "angle"), ("N", "load0"), ("kPa", None)]
)
def test_the_unit_tells_what_swings(tmp_path: Path, unit: str, role: str | None) -> None:
    log = bench_log()
    path = written(tmp_path, f"time [s];channel 1 [{unit}]", [log["time"], log["laser"]])
    assert roles(path)["channel 1"] == role


def test_edge_times_without_a_unit_are_in_that_of_the_clock(tmp_path: Path) -> None:
    log = bench_log()
    ticks = 1e3 * log["time"]
    edges = np.maximum.accumulate(np.where(np.diff(log["encoder"], prepend=0) != 0, ticks - 0.3, 0.0))
    path = written(tmp_path, "Zeit [ms];Geber;Flanke", [ticks, log["encoder"], edges])
    column = draft([path], Answers()).logs[0].files[0].columns[2]
    assert (column.role, column.unit) == ("encoder_edge_time", "ms")
    assert column.guessed["unit"] == "that of 'Zeit'"


def test_a_movement_that_dies_away_without_a_drive_is_a_free_decay(tmp_path: Path) -> None:
    time = bench_log()["time"]
    for size, kind in ((np.exp(-time), "free-decay"), (1.0, "stick-slip")):
        path = written(tmp_path, "t [s];Geber", [time, np.floor(40 * size * np.cos(12 * time))])
        assert draft([path], Answers()).logs[0].kind == kind


def test_a_counter_that_wraps_and_time_in_other_units(tmp_path: Path) -> None:
    log = bench_log()
    wrapped = np.mod(log["drive"] + 200, 256)
    path = written(tmp_path, "Takt;Weg;Geber;Antrieb", [1e3 * log["time"] + 7.5, log["laser"], log["encoder"], wrapped])
    columns = {one.name: one for one in draft([path], Answers()).logs[0].files[0].columns}
    assert columns["Takt"].role == "time" and columns["Takt"].unit == "ms" and "unit" in columns["Takt"].guessed
    assert columns["Antrieb"].role == "drive0_count"


def test_days_of_a_spreadsheet_are_times(tmp_path: Path) -> None:
    log = bench_log()
    path = tmp_path / "x.csv"
    days = [f"{45965.5 + t / 86400:.12f}" for t in log["time"]]
    path.write_text("Date,laser\n" + "\n".join(f"{d},{v}" for d, v in zip(days, log["laser"], strict=True)) + "\n")
    (column,) = (one for one in draft([path], Answers()).logs[0].files[0].columns if one.name == "Date")
    assert (column.role, column.unit) == ("time", "d")


def test_a_wrong_name_does_not_outweigh_the_numbers(tmp_path: Path) -> None:
    log = bench_log()
    found = roles(
        written(tmp_path, "clock;time;laser;Antrieb", [log["time"], log["laser"], log["laser"], log["drive"]])
    )
    assert found["time"] != "time" and found["clock"] == "time"


def test_options_and_files_say_the_same(tmp_path: Path) -> None:
    said = from_options(
        ["Weg=laser V"], ["Zeit=ms"], ["J=0.05"], ["J=0.001"], ["x.csv=free-decay"], ["decimal=comma"], None, True
    )
    file = tmp_path / "answers.toml"
    file.write_text(
        'confirm = true\n[columns]\nWeg = "laser V"\n[values]\nJ = "0.05 ± 0.001"\n[kinds]\n"x.csv" = "free-decay"\n'
        '[read]\ndecimal = "comma"\n'
    )
    read = from_file(file)
    assert read.columns == said.columns and read.values == said.values and read.kinds == said.kinds
    assert said.units == {"Weg": "V", "Zeit": "ms"} and read.read == said.read and read.confirm
    for wrong, message in (
        ('[columns]\nWeg = "lasr"', "line 2.*no role 'lasr'.*Did you mean 'laser'"),
        ("[values]\nJ = [1]", "line 2.*expected a text or a number"),
        ("[valus]\nJ = 1", "valus"),
        ('[kinds]\nx = "slip"', "no kind of experiment 'slip'"),
    ):
        file.write_text(wrong)
        with pytest.raises(StickslipError, match=message):
            from_file(file)


def test_two_columns_for_one_role_are_refused(tmp_path: Path) -> None:
    log = bench_log()
    path = written(tmp_path, "Zeit;Weg;Abstand", [log["time"], log["laser"], log["laser"]])
    with pytest.raises(StickslipError, match=r"'Weg' and 'Abstand' are both said to be 'laser'"):
        roles(path, Answers(columns={"Weg": "laser", "Abstand": "laser"}))
    found = roles(path, Answers(columns={"Abstand": "laser"}))
    assert found["Abstand"] == "laser" and found["Weg"] is None
    with pytest.raises(StickslipError, match=r"no column 'Wag'.*Did you mean 'Weg'"):
        roles(path, Answers(columns={"Wag": "laser"}))


def changed(path: Path, edit) -> None:
    sidecar = path.parent / "datapackage.json"
    content = json.loads(sidecar.read_text())
    edit(content["resources"][0])
    sidecar.write_text(json.dumps(content))


def test_a_described_log_is_read_by_its_roles(described: Path) -> None:
    log = read_log(described)
    np.testing.assert_allclose(log.time, bench_log()["time"], atol=1e-9)
    assert set(log.columns) == {"laser", "encoder_count", "drive0_count"} and log.warnings == ()


FAULTS = {
    "two columns for one role": (
        lambda r: r["schema"]["fields"][2].update(role="laser"),
        "two columns, 'Weg' and 'Geber'",
    ),
    "a role without a column": (
        lambda r: r["schema"]["fields"][1].update(name="Wag"),
        r"no column 'Wag', which .* calls 'laser'.*--map COLUMN=laser",
    ),
    "contradictory units": (
        lambda r: r["schema"]["fields"][0].update(unit="s"),
        r"'Zeit' is in 'ms' by its header and in 's' by datapackage\.json.*--unit 'Zeit=ms'",
    ),
    "an unknown role": (lambda r: r["schema"]["fields"][1].update(role="lasr"), "unknown role 'lasr'.*'laser'"),
    "an unknown option": (lambda r: r.update(dialect={"sheet": "x"}), "no option 'sheet'"),
    "a rate that is none": (lambda r: r.update(sampling_rate="fast"), "sampling_rate"),
    "a way to join that is none": (lambda r: r.update(path=["x.csv", "x.csv"], join="glue"), "found 'glue'"),
    "a file that is not there": (lambda r: r.update(path=["x.csv", "y.csv"], join="time"), "no log"),
}


@pytest.mark.parametrize(("change", "message"), FAULTS.values(), ids=FAULTS)
def test_a_sidecar_that_contradicts_its_log_is_refused(described: Path, change, message: str) -> None:
    changed(described, change)
    with pytest.raises(StickslipError, match=message):
        read_log(described)


def test_a_unit_that_the_user_overrules_is_kept(described: Path) -> None:
    from dataclasses import replace

    write(draft([described], replace(SAID, units={"Zeit": "s"})))
    with pytest.raises(StickslipError, match="Milliseconds"):
        read_log(described)
    write(draft([described], replace(SAID, units={"Zeit": "ms"})))
    assert read_log(described).time[-1] == pytest.approx(3.999)


def test_one_unit_in_two_spellings_is_no_contradiction(described: Path) -> None:
    changed(described, lambda r: r["schema"]["fields"][1].update(unit="volt"))
    assert read_log(described).column("laser") == pytest.approx(bench_log()["laser"])


def test_what_a_column_is_as_an_input_stays_when_it_is_described_again(described: Path) -> None:
    changed(described, lambda r: r["schema"]["fields"][1].update(hold=True, variable="q"))
    write(draft([described], SAID))
    log = read_measured(described)
    assert (log.stepwise, log.variables) == ({"Weg"}, {"Weg": "q"})
    changed(described, lambda r: r["schema"]["fields"][1].update(hold="yes"))
    with pytest.raises(StickslipError, match="\"hold\" of column 'Weg' is 'yes'; expected true or false"):
        read_measured(described)


def test_the_speed_of_a_drive_that_no_column_shows_is_asked_for_and_kept(tmp_path: Path) -> None:
    log = bench_log()
    path = written(tmp_path, "t [s];laser [V]", [log["time"], log["laser"]])
    values = {"laser": "0.01 m/V, 5 V", **dict.fromkeys(("J", "k", "c", "R", "r", "N0"), "unknown")}
    answers = Answers(values=values, kinds={"x.csv": "stick-slip"}, confirm=True)
    (asked,) = questions(draft([path], answers))
    assert asked.key == "w:x.csv" and "shows the drive" in asked.text
    write(draft([path], answers.over(Answers(values={"w:x.csv": "8.0 ± 0.1 rpm"}))))
    again = draft([path], Answers())  # described once more, nothing is lost
    assert not questions(again)
    write(again)
    experiment = read_log(path).experiment
    assert (experiment.kind, experiment.contacts) == ("stick-slip", ("disc0",))
    assert experiment.drive_speed == pytest.approx((8 * np.pi / 30,))
    assert experiment.drive_speed_uncertainty == pytest.approx((0.1 * np.pi / 30,))
    for wrong, message in (({"w:y.csv": "1"}, "no such log"), ({"w:x.csv": "1 kg"}, "cannot be converted to rad/s")):
        with pytest.raises(StickslipError, match=message):
            write(draft([path], Answers(values=wrong)))


@pytest.mark.parametrize(("unit", "asked"), [("V", ["laser", "R"]), ("mm", ["R"]), (None, ["encoder"])])
def test_a_free_decay_is_asked_for_the_radius_that_its_laser_looks_at(
    tmp_path: Path, unit: str | None, asked: list[str]
) -> None:
    """No drive and no friction; an encoder alone shows the angle without a radius."""
    log = bench_log()
    seen = ("Geber", log["encoder"]) if unit is None else (f"laser [{unit}]", log["laser"])
    path = written(tmp_path, f"t [s];{seen[0]}", [log["time"], seen[1]])
    answers = Answers(kinds={"x.csv": "free-decay"}, confirm=True)
    assert [one.key for one in questions(draft([path], answers))] == asked


UNFIT = {
    "1/min": "counts radians or whole turns. Write rad/s, deg/s, turn/s or rpm",
    "Hz": "counts radians or whole turns",
    "Grad/s": "may be degrees or gon. Write deg or gon",
    "kg": "cannot be converted to rad/s",
    "blink": ". Write rad/s, deg/s, turn/s or rpm",
}


@pytest.mark.parametrize("unit", ["deg", "kg", "Impulse"])
def test_counts_have_no_unit(tmp_path: Path, unit: str) -> None:
    """The reader would take degrees of a count for 0.017 counts each."""
    log = bench_log()
    path = written(
        tmp_path, "t [s];laser [V];Geber;Antrieb", [log[name] for name in ("time", "laser", "encoder", "drive")]
    )
    with pytest.raises(StickslipError, match=rf"'Geber' \(encoder_count\) is in '{unit}', but counts have no unit"):
        draft([path], Answers(units={"Geber": unit}))
    for counted in ("1", "counts"):
        draft([path], Answers(units={"Geber": counted}))


@pytest.mark.parametrize(("unit", "message"), UNFIT.items())
def test_a_unit_that_a_role_cannot_have_is_refused_where_it_is_said(tmp_path: Path, unit: str, message: str) -> None:
    log = bench_log()
    speed = 0.9 + 0.01 * np.sin(log["time"])
    path = written(tmp_path, "t [s];laser [V];motor speed [1/min]", [log["time"], log["laser"], speed])
    with pytest.raises(StickslipError, match=rf"'motor speed' \(drive0_speed\).*'{unit}'.*{message}"):
        draft([path], Answers(units={"motor speed": unit}))
    assert UNFIT["1/min"] in questions(draft([path], Answers()))[0].text  # of the file: it is asked for
    assert not questions(draft([path], Answers(units={"motor speed": "rpm"})))[0].text.startswith("Column")


@pytest.mark.parametrize("header", ["motor_rpm", "motor_rpm [rad/s]"])
def test_a_unit_in_a_name_is_proposed_where_the_file_states_none(tmp_path: Path, header: str) -> None:
    log = bench_log()
    speed = 8.0 + 0.01 * np.sin(log["time"])
    path = written(tmp_path, f"t [s];laser [V];{header};laser rpm", [log["time"], log["laser"], speed, log["laser"]])
    *_, motor, other = draft([path], Answers()).logs[0].files[0].columns
    proposed = "rad/s" not in header
    assert (motor.role, motor.unit) == ("drive0_speed", "rpm" if proposed else "rad/s")
    assert motor.guessed.get("unit") == ("its name says 'rpm'" if proposed else None)
    assert other.unit != "rpm"  # of no speed


def test_guesses_are_marked_until_they_are_confirmed(tmp_path: Path) -> None:
    from dataclasses import replace

    log = bench_log()
    path = written(tmp_path, "Zeit;Weg;Geber;Antrieb", [log["time"], log["laser"], log["encoder"], log["drive"]])
    made = draft([path], replace(SAID, confirm=False))
    fields = {one["name"]: one for one in package_of(made)["resources"][0]["schema"]["fields"]}
    assert set(fields["Zeit"]["guessed"]) == {"role", "unit"} and fields["Weg"]["confidence"] > 0.6
    assert [q.key for q in questions(made)] == ["columns", "J", "k", "c", "r", "N0"]
    write(made)
    with pytest.warns(
        UserWarning, match=r"the role of 'Zeit'.* are guessed; confirm it: stickslip describe FILES --confirm"
    ):
        read_log(path)
    write(draft([path], Answers(confirm=True)))
    assert read_log(path).warnings == ()


def test_an_unknown_instrument_leaves_its_column_unread(described: Path) -> None:
    from dataclasses import replace

    write(draft([described], replace(SAID, values={**SAID.values, "encoder": "unknown"})))
    with pytest.warns(UserWarning, match="'encoder_count' is not read: its calibration is not known"):
        assert "encoder_count" not in read_log(described).columns


def test_a_log_without_a_clock_takes_a_rate(tmp_path: Path) -> None:
    log = bench_log()
    path = written(tmp_path, "Weg;Geber;Antrieb", [log["laser"], log["encoder"], log["drive"]])
    from dataclasses import replace

    made = draft([path], SAID)
    assert "is the time" in questions(made)[0].text
    write(draft([path], replace(SAID, values={**SAID.values, "sampling_rate": "1 kHz"})))
    np.testing.assert_allclose(read_log(path).time, log["time"], atol=1e-12)


def test_a_rule_is_proposed_for_files_that_need_each_other_and_for_no_other(tmp_path: Path) -> None:
    time = np.arange(200) / 100
    (tmp_path / "run_clock.csv").write_text("time [s]\n" + "\n".join(f"{t:g}" for t in time) + "\n")
    (tmp_path / "run_laser.csv").write_text("laser [V]\n" + "\n".join(f"{np.sin(t):.6g}" for t in time) + "\n")
    paths = sorted(tmp_path.glob("*.csv"))
    (log,) = draft(paths, Answers()).logs
    assert (log.rule, len(log.files), log.name) == ("columns", 2, "run")
    assert [log.rule for log in draft(paths[1:], Answers()).logs] == [None]
