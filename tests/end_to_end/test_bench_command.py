"""The command `stickslip bench` as a user meets it."""

from __future__ import annotations

import csv
import json
import sys

import pytest

from identification import cli


def run(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["stickslip", "bench", *map(str, arguments)])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    printed = capsys.readouterr()
    return stopped.value.code, printed.out, printed.err


def test_a_short_scene_in_json_csv_page_and_figure(monkeypatch, capsys, tmp_path):
    words = [text for word in ("Taylor", "DOP853", "eta 0.001", "tanh 0.001, LSODA") for text in ("--method", word)]
    files = {kind: tmp_path / f"bench.{kind}" for kind in ("csv", "html", "svg")}
    code, out, _ = run(
        *(monkeypatch, capsys, "discontinuous_support_table_1", "--until", 6.283185307179586, "--json", *words),
        *("-o", files["csv"], "--page", files["html"], "--figure", files["svg"]),
    )
    assert code == 0
    (scene,) = json.loads(out)["scenes"]
    assert scene["reference"].startswith("closed form")
    assert scene["expected"] == 2
    rows = scene["rows"]
    ours = rows[0]
    assert ours["error"] < 1e-13
    families = {row["family"] for row in rows}
    assert families == {"event-driven", "switch model", "smoothing"}
    # the band and the width set floors that the tolerance does not reach
    for family in ("switch model", "smoothing"):
        assert min(row["error"] for row in rows if row["family"] == family) > 1e-8
    with files["csv"].open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(rows)
    assert "<svg" in files["html"].read_text("utf-8")
    assert files["svg"].stat().st_size > 10_000


def test_impacts_name_what_can_treat_them(monkeypatch, capsys):
    code, out, _ = run(
        monkeypatch, capsys, "bouncing_ball_period_1", "--until", 0.1, "--method", "tanh", "--method", "stickslip"
    )
    assert code == 0
    out = " ".join(out.split())
    assert "no smooth right-hand side" in out
    assert "Moreau time-stepping" in out


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("bouncing_bal",), "Did you mean 'bouncing_ball"),
        (("bouncing_ball", "--method", "euler"), "No method has 'euler'"),
        (("bouncing_ball", "--until", "-1"), "must end after it starts"),
        (("bouncing_ball", "impact_pair", "--figure", "a.svg"), "--figure draws one scene"),
        (("bouncing_ball", "--figure", "a.bmp"), "no known format"),
    ],
)
def test_bad_input(monkeypatch, capsys, arguments, says):
    code, _, err = run(monkeypatch, capsys, *arguments)
    assert code == 2
    assert says in " ".join(err.split())
