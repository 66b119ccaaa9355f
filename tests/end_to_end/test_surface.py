"""What a person sees at terminals of 60, 80 and 200 columns, through the real commands."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
RIGS = ROOT / "data" / "rigs" / "paper_rubber"
SCENES = ROOT / "data" / "scenes"
WIDTHS = (60, 80, 200)


def lines(text: str, width: int) -> list[str]:
    """Lines of a terminal, none of them longer than it is wide."""
    found = text.splitlines()
    assert all(len(line) <= width for line in found), max(found, key=len)
    return found


def strobes(folder: Path, count: int) -> Path:
    """The scene of a resonance with ``count`` strobed runs, short ones."""
    text = (SCENES / "discontinuous_support_figure_11.toml").read_text()
    text = text.partition("[[reference]]")[0].replace('"4000 s"', '"400 s"')
    values = ", ".join(f"{0.39 + 0.012345678 * i:.9g}" for i in range(count))
    text = re.sub(r"values = \[.*?\]", f"values = [{values}]", text, flags=re.S)
    (folder / "many.toml").write_text(text)
    return folder / "many.toml"


@pytest.mark.parametrize("width", WIDTHS)
def test_a_scene_of_thirty_strobes_has_a_row_each(stickslip, tmp_path, monkeypatch, width):
    monkeypatch.setenv("COLUMNS", str(width))
    scene = strobes(tmp_path, 30)
    found = {row["at"]: row["values"] for row in stickslip("scene", scene, "--json").json["results"]}
    text = lines(stickslip("scene", scene).out, width)
    assert len(found) == 30
    for at, values in found.items():
        # at 60 columns the table goes on in a second block
        row = " ".join(line for line in text if line.startswith(f"f0 = {at:g} "))
        for value in values.values():
            assert f"{value:.10g}" in row.split()


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    return tmp_path_factory.mktemp("fitted") / "fit.json"


@pytest.mark.nightly_for("60", "200")
@pytest.mark.parametrize("width", WIDTHS)
def test_a_fit_keeps_its_digits_at_any_width(stickslip, monkeypatch, width, fitted):
    monkeypatch.setenv("COLUMNS", str(width))
    answer = stickslip("fit", RIGS, "--estimator", "weak-form", "--overwrite", "--result", fitted)
    text = answer.out
    assert answer.code == 0
    lines(text, width)
    fit = json.loads(fitted.read_text())
    words = text.split()
    for one in fit["parameters"]:
        # two digits of the deviation decide those of the value; the first interval is that of noise, constants and law
        place, again = [i for i, word in enumerate(words) if word == one["name"]][:2]
        value, low, _, high, noise, scale, law = words[place + 1 : place + 8]
        law = words[again + 1] if width == 60 else law  # where the table goes on in a second block
        total = sum(one[f"sd_{kind}"] ** 2 for kind in ("noise", "rig_constants", "law")) ** 0.5
        assert abs(float(low) - one["low"]) < 0.06 * total and abs(float(high) - one["high"]) < 0.06 * total
        assert one["high"] - one["low"] == pytest.approx(2 * 2.0 * total, rel=0.03)  # Student's t of 40 slips and more
        assert float(noise) == pytest.approx(one["sd_noise"], rel=0.051)
        assert float(scale) == pytest.approx(one["sd_rig_constants"], rel=0.051)
        assert float(law) == pytest.approx(one["sd_law"], rel=0.051)
        assert abs(float(value) - one["value"]) < 0.06 * total
    assert ("meaning" in words) == (width == 200) or "Left out for want of width" in text
    for head in ("parameter", "value", "noise", "constants", "correction"):
        assert any(head in word for word in words), head


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize(
    "arguments", [("models",), ("scene",), ("show", "disc_rig"), ("map", "henon", "--period", "2"), ("maps",)]
)
def test_lists_and_sheets_fit_the_terminal(stickslip, monkeypatch, width, arguments):
    monkeypatch.setenv("COLUMNS", str(width))
    answer = stickslip(*arguments)
    assert answer.code == 0
    lines(answer.out, width)


@pytest.mark.nightly
def test_options_take_the_names_that_the_table_prints(stickslip):
    weak = ("fit", RIGS, "--estimator", "weak-form")
    other = {"J": 0.055, "R": 0.126, "r": 0.061, "N": 4.9, "k/J": 47.7, "c/J": 1.01}
    assert [one["name"] for one in stickslip(*weak, "--json").json["constants"]] == list(other)
    settings = [part for name, value in other.items() for part in ("--set", f"{name}={value}")]
    given = {one["name"]: one for one in stickslip(*weak, *settings, "--json").json["constants"]}
    assert {name: one["value"] for name, one in given.items()} == pytest.approx(other)
    assert all(one["sd"] == 0.0 for one in given.values())
    assert given["k/J"]["from"] == "set"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--set", "mass=1"), "Known are: J, k, c, R, r, N0, N1, N"),
        (("--set", "k=2.6"), "k/J is known from the free decay 'free-decay', so that k is not used. Set k/J."),
        (("--free", "N0", "--estimator", "shooting"), "Known are: J, R, r, N, k/J, c/J, zero."),
    ],
)
def test_an_unknown_name_lists_those_that_are_known(stickslip, arguments, said):
    answer = stickslip("fit", RIGS, *arguments)
    assert answer.code == 2 and said in answer.err
