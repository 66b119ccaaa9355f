"""Logs as six recorders leave them: described by answers or on a terminal, fitted, and the truth found."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import pytest

pytest.importorskip("nptdms")
pytest.importorskip("asammdf")

from recorders import DRIFT, OFFSET, RECORDERS, TRUTH, bench, record

MOST_QUESTIONS = 13
TYPED = {
    "roles, units and kinds": "yes",
    "metres per volt": "0.01 ± 0.00002 m/V, 5 V",
    "what does it see": "",  # proposed: sine
    "how late is it": "",  # proposed: not
    "rms noise": "",  # proposed: not known
    "encoder of the disc": "1000",
    "encoder of driving disc 0": "",  # proposed: that of the disc
    "J:": "0.0548 ± 0.0003",
    "R:": "125 ± 0.05 mm",
    "r:": "0,06 ± 0,00005",
    "N0:": "4.905 +- 0.005 N",
}


@pytest.fixture(scope="session")
def recorded(tmp_path_factory) -> Path:
    """Folders of all recorders, with answers beside them."""
    folder = tmp_path_factory.mktemp("recorded")
    logs = bench()
    for name in RECORDERS:
        record(folder, name, logs)
    return folder


@pytest.fixture
def own(recorded: Path, tmp_path: Path):
    """A copy of one recorder's logs, and its answers."""

    def copied(name: str) -> tuple[Path, Path]:
        target = tmp_path / "copy" / name
        shutil.copytree(recorded / name, target)
        return target, recorded / f"{name}.toml"

    return copied


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "datapackage.json"}


@pytest.mark.nightly_for("mdf", "signals", "semicolons", "lvm", "two_recorders")
@pytest.mark.parametrize("name", RECORDERS)
def test_from_a_recorders_files_to_a_fit_by_answers(stickslip, own, name: str) -> None:
    folder, answers = own(name)
    before = contents(folder)
    told = stickslip("describe", folder, "--answers", answers, "--json")
    assert told.code == 0 and told.json["complete"] and told.json["questions"] == []
    assert contents(folder) == before, "a log is never rewritten"
    fit = stickslip("fit", folder, "--json")
    assert fit.code == 0, fit.err
    for parameter in fit.json["parameters"]:
        total = (parameter["sd_noise"] ** 2 + parameter["sd_rig_constants"] ** 2) ** 0.5
        assert abs(parameter["value"] - TRUTH[parameter["name"]]) < 1.96 * total
        assert total < 0.02 * TRUTH[parameter["name"]]
    assert "guessed" not in fit.err


def test_two_clocks_are_found_and_their_uncertainty_carried_on(stickslip, own) -> None:
    folder, answers = own("two_recorders")
    stickslip("describe", folder, "--answers", answers, "--json")
    from rig_io import read_package

    with pytest.warns(UserWarning, match="two recorders were put on one clock"):
        logs = read_package(folder)
    for log in logs:
        assert 0 < log.clock_deviation < 1e-3
        assert any("offset" in warning and "ppm" in warning for warning in log.warnings)
    assert OFFSET > 0 and DRIFT > 0


@pytest.mark.nightly_for("mdf", "semicolons", "tdms", "signals")
@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are of POSIX")
@pytest.mark.parametrize("name", [name for name in RECORDERS if name != "two_recorders"])
def test_by_hand_on_a_terminal(own, name: str) -> None:
    from terminal import by_table, talk

    folder, _ = own(name)
    typed = dict(TYPED)
    if name == "signals":
        typed["What is to be changed"] = "*_zeit.t=time s; *_weg.dat=laser V"
    code, asked, shown = talk(["describe", folder], by_table(typed))
    assert code == 0, shown
    assert len(asked) <= MOST_QUESTIONS, asked
    assert len(set(asked)) == len(asked), "no question twice"
    written = json.loads((folder / "datapackage.json").read_text(encoding="utf-8"))
    assert written["rig"]["J"] == {"value": 0.0548, "unit": "kg*m^2", "standard_uncertainty": 0.0003}
    assert written["rig"]["R"]["value"] == pytest.approx(0.125) and "k" not in written["rig"]
    assert not any("guessed" in field for one in written["resources"] for field in one["schema"]["fields"])
    kinds = sorted(one["experiment"]["kind"] for one in written["resources"])
    assert kinds == ["free-decay", *["stick-slip"] * 3]


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are of POSIX")
def test_where_nobody_can_answer_nobody_waits(own, monkeypatch) -> None:
    """A notebook gives its `!` commands a terminal too; at the end of the input the options are named."""
    from terminal import talk

    folder, _ = own("semicolons")
    code, asked, shown = talk(["describe", folder], lambda question: "\x04")
    assert code == 2 and len(asked) == 1 and "--confirm" in shown and "--set 'J=" in shown
    assert not (folder / "datapackage.json").exists()
    monkeypatch.setenv("JPY_PARENT_PID", "1")
    code, asked, shown = talk(["describe", folder], lambda question: "")
    assert code == 0 and not asked and "Nobody answers here" in shown and "--set 'laser_noise=20 um'" in shown


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are of POSIX")
def test_a_wrong_answer_is_asked_again_with_the_reason(own) -> None:
    from terminal import by_table, talk

    folder, _ = own("semicolons")
    (folder / "free-decay.csv").unlink()
    wrong = iter(["0.0548 ± 0.0003 N", "about a twentieth", "unknown"])
    typed = by_table({**TYPED, "k:": "2.62 ± 0.5 %", "c:": "unknown"})
    code, asked, shown = talk(["describe", folder], lambda q: next(wrong) if q.startswith("J:") else typed(q))
    assert code == 0, shown
    assert "cannot be converted" in shown and "no number with its uncertainty" in shown
    assert len(set(asked)) == MOST_QUESTIONS
    rig = json.loads((folder / "datapackage.json").read_text(encoding="utf-8"))["rig"]
    assert rig["J"]["value"] is None and rig["c"]["value"] is None
    assert rig["k"]["standard_uncertainty"] == pytest.approx(0.0131)


def test_a_second_log_of_the_same_recorder_needs_no_answers(stickslip, own, tmp_path: Path) -> None:
    first, answers = own("semicolons")
    stickslip("describe", first, "--answers", answers, "--json")
    second = tmp_path / "second"
    second.mkdir()
    shutil.copy(first / "paper-rubber-1.4.csv", second / "next.csv")
    told = stickslip("describe", second, "--like", first, "--json")
    assert told.json["complete"], told.json["questions"]
    written = json.loads((second / "datapackage.json").read_text(encoding="utf-8"))
    assert written["rig"]["J"]["standard_uncertainty"] == 0.0003
    assert written["resources"][0]["calibration"]["encoder"]["pulses_per_revolution"] == 1000


@pytest.mark.nightly
def test_unknown_uncertainties_travel_to_the_fit(stickslip, own) -> None:
    folder, answers = own("semicolons")
    said = answers.read_text(encoding="utf-8").replace("± 0.0003 kg", "± unknown kg").replace(", 5 V", ", unknown")
    own_answers = folder.parent / "own.toml"
    own_answers.write_text(said, encoding="utf-8")
    stickslip("describe", folder, "--answers", own_answers, "--json")
    fit = stickslip("fit", folder, "--estimator", "weak-form", "--json")
    assert any("How well J is known is not stated" in warning for warning in fit.json["warnings"])
    source = next(one["from"] for one in fit.json["constants"] if one["name"] == "J")
    assert "uncertainty unknown" in source
    assert any("reading at rest is not known" in warning for warning in fit.json["warnings"])
    values = {one["name"]: one["value"] for one in fit.json["parameters"]}
    assert values["mu_s"] == pytest.approx(TRUTH["mu_s"], rel=0.02)
