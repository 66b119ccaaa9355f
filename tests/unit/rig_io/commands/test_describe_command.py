"""What the command that describes logs prints, proposes and leaves alone."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from typer.testing import CliRunner
from whole_application import app

from fmu_models.base.errors import StickslipError
from rig_io.description.answers import Answers
from rig_io.description.draft import draft, write
from rig_io.description.figure import columns_figure
from rig_io.readers import csv_log

WIDE = CliRunner(env={"COLUMNS": "400"})  # paths stay on one line


def swing(path: Path) -> Path:
    """The log of a laser that sees a disc swing."""
    time = 0.001 * np.arange(4000)
    path.parent.mkdir(exist_ok=True)
    csv_log.write(path, {"t [s]": time, "laser [mm]": 25 * np.sin(12 * time)})
    return path


def test_the_fit_that_is_proposed_takes_a_decay_of_another_folder_where_there_is_none_beside(tmp_path: Path) -> None:
    logs, other = (swing(tmp_path / folder / "run.csv").parent for folder in ("logs", "other"))
    decay = swing(logs / "decay.csv")
    stated = dict.fromkeys(("J", "k", "c", "R", "r", "N0", "w:run.csv"), "unknown")
    said = [option for name, value in stated.items() for option in ("--set", f"{name}={value}")]
    said += ["--kind", "decay.csv=free-decay", "--kind", "run.csv=stick-slip", "--confirm"]
    shown = WIDE.invoke(app, ["describe", str(logs), *said]).output
    assert shown.split("Fit:")[1].split() == ["stickslip", "fit", str(logs)]
    again = ["describe", str(other), "--like", str(logs), "--set", "w:run.csv=unknown", "--kind", "run.csv=stick-slip"]
    shown = WIDE.invoke(app, again).output
    assert "run.csv: stick-slip (as said)" in shown and "laser [mm]" not in shown
    assert re.search(r"laser +laser +mm +\d+ %", shown)  # what nobody was asked about is shown
    assert shown.split("Fit:")[1].split() == ["stickslip", "fit", str(other), str(decay)]


def test_kinds_that_were_confirmed_are_known_of_like_logs(tmp_path: Path) -> None:
    logs, other = tmp_path / "logs", tmp_path / "other"
    for path in (logs / "run.csv", logs / "decay.csv", other / "again.csv", other / "decay2.csv"):
        swing(path)
    first = draft([logs], Answers(kinds={"run.csv": "stick-slip"}))
    write(first)

    def said(folder: Path) -> dict[str, bool]:
        return {log.name: log.kind_said for log in draft([folder], Answers(), logs).logs}

    assert said(other) == {"again": True, "decay2": False}  # that of decay.csv is a guess still
    write(draft([logs], Answers(kinds={"run.csv": "stick-slip"}, confirm=True)))
    assert said(other) == {"again": True, "decay2": True}
    (other / "decay2.csv").write_text((other / "decay2.csv").read_text().replace("laser [mm]", "Weg Laser [mm]"))
    assert said(other) == {"again": True, "decay2": False}  # of another layout


def test_a_figure_that_exists_stays_and_nothing_is_described(tmp_path: Path) -> None:
    path, figure = swing(tmp_path / "run.csv"), tmp_path / "columns.svg"
    figure.write_text("mine")
    done = CliRunner().invoke(app, ["describe", str(path), "--figure", str(figure)])
    assert isinstance(done.exception, StickslipError) and "exists already" in str(done.exception)
    assert figure.read_text() == "mine" and not (tmp_path / "datapackage.json").exists()


def test_a_figure_names_each_column_with_its_role_and_unit(tmp_path: Path) -> None:
    path = swing(tmp_path / "run.csv")
    path.write_text(path.read_text().replace("laser [mm]", "Kanal"))
    columns = columns_figure(draft([path], Answers(columns={"Kanal": "none"})).logs).axes
    assert [axis.get_title(loc="left").split(",")[0] for axis in columns] == ["t: time", "Kanal: no role"]
    assert [axis.get_ylabel() for axis in columns] == ["s", "?"]
    assert np.asarray(columns[0].lines[0].get_ydata())[-1] == 3.999
