"""What ``show`` draws and ``inspect`` tells of a packed system, and what ``couple`` makes of it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from test_structures_of_ssp import bound, connectors, described, nested, values
from typer.testing import CliRunner
from whole_application import app


def said(*words: object) -> str:
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    return done.output


def test_a_system_is_drawn_as_boxes_in_boxes(tmp_path: Path) -> None:
    lines = said("show", nested(tmp_path)).splitlines()
    # how deep a line is: the bars on its left
    depth = {line.strip("│╭╰─ ╮╯"): len(line) - len(line.lstrip("│ ╭")) for line in lines}
    (a,) = (d for words, d in depth.items() if words.startswith("a: mass.fmu"))
    (left,) = (d for words, d in depth.items() if words.startswith("left"))
    (top,) = (d for words, d in depth.items() if words.startswith("top ") or words == "top")
    assert top < left < a
    text = "\n".join(lines)
    for words in ("push (mm) = 250", "other (m) = 0.25", "other (m) <- 2 left.a.place + 0.1", "k (N/m) = 3"):
        assert words in text
    (shown,) = (line for line in lines if "shown (ell)" in line)
    assert "right.b.place" in shown and shown.index("shown") > len(shown) // 2


def test_a_system_is_told(tmp_path: Path) -> None:
    path = nested(tmp_path, values("nobody Real 1"))
    content = json.loads(CliRunner().invoke(app, ["inspect", str(path), "--json"]).stdout)
    assert content["units"]["left.a"]["interfaces"] == ["Model Exchange", "Co-Simulation"]
    by_name = {c["name"]: c for c in content["connectors"]}
    assert (by_name["left.a.k"]["value"], by_name["left.a.k"]["unit"]) == (pytest.approx(3.0), "N/m")
    assert by_name["left.a.place"]["to"] == ["right.b.other"]
    shown = by_name["shown"]
    assert shown["unit"] == "ell" and shown["from"].endswith(" right.b.place")
    text = said("inspect", path)
    assert "right.b.other" in text and "2 left.a.place + 0.1" in text
    assert "has nothing called 'nobody'" in CliRunner().invoke(app, ["inspect", str(path)]).stderr
    refused = CliRunner().invoke(app, ["show", str(path), "--contacts", "a"])
    assert "Leave --contacts out" in str(refused.exception)


def test_a_run_of_it_is_drawn(tmp_path: Path) -> None:
    figure = tmp_path / "run.svg"
    said("couple", nested(tmp_path), "--figure", figure, "--plot", "left.a.x,shown")
    assert "left.a" in figure.read_text()
    alone = described(tmp_path, connectors("u input Real m") + bound(values("u Real 3 cm")))
    assert "values alone" in said("couple", alone, "-o", tmp_path / "alone.csv")
    assert (tmp_path / "alone.csv").read_text().splitlines()[-1].split(",")[-1] == "0.03"
