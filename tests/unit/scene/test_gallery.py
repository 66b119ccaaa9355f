"""The gallery of the manual: each scene and oscillator has its page; a known value that is not met stops the build."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest
from made.figures import PAPERS, figure_of, figures_of
from made.gallery import make, table
from made.gallery_jobs import CALIBRATIONS
from matplotlib.image import imread

from fmu_models import StickslipError, read_scene
from fmu_models.oscillators import MODELS
from fmu_models.scene.read import files, find

PAIR = next(case for case in CALIBRATIONS if case.model == "impact_pair")


def test_every_oscillator_is_of_one_paper():
    assert Counter(name for paper in PAPERS for name in paper.models) == Counter(MODELS.members())


def test_every_figure_of_the_papers_has_five_known_values_or_a_reason():
    scenes = [read_scene(path) for path in files()]
    few = {}
    for paper in PAPERS:
        for number in set(range(1, paper.figures + 1)) - set(paper.elsewhere):
            of_it = [s for s in scenes if s.model in paper.models and number in figures_of(s.source)]
            values = sum(len(reference.values) for scene in of_it for reference in scene.references)
            if values < 5:
                few[f"{paper.title}, figure {number}"] = values
    assert not few


def test_every_oscillator_has_a_scene_with_known_values():
    scenes = [read_scene(path) for path in files()]
    assert {scene.model for scene in scenes if scene.references} == set(MODELS.members())


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """The gallery of two scenes, a model and a calibration."""
    folder = tmp_path_factory.mktemp("gallery")
    scenes = [find("planar_hopf_cycle"), find("planar_hopf_figure_2")]
    make(
        scenes, ["planar_hopf"], folder / "pages", folder / "site" / "live", [PAIR], literature=[find("lotka_volterra")]
    )
    return folder


def test_pages_are_there_with_their_pictures_and_lead_to_one_another(made):
    pages = made / "pages"
    found = {str(page.relative_to(pages)): page.read_text("utf-8") for page in pages.rglob("*.md")}
    assert set(found) == {
        "figures.md",
        "index.md",
        "literature.md",
        "calibrations/calibrated_pair.md",
        "oscillators/planar_hopf.md",
        "scenes/planar_hopf_cycle.md",
        "scenes/planar_hopf_figure_2.md",
    }
    for name, text in found.items():
        for link in re.findall(r"\]\(([^)]+)\)", text):
            if not link.endswith(("claims.md", "return_maps.md", "calibrate.md", "impact_pair.md")):
                assert ((pages / name).parent / link).is_file(), f"{name}: {link}"
    assert all(name in found["index.md"] for name in set(found) - {"index.md"})


def test_every_figure_has_its_row(made):
    text = (made / "pages/figures.md").read_text("utf-8")
    row = r"\| 2 \| `stickslip scene planar_hopf_figure_2`<br>[^|]+\| \[!\[\]\(pictures/.*\)\]\(.*\) \| 7 \|"
    assert re.search(row, text)
    assert "| 7 | a drawing |  |  |" in text


def test_known_values_stand_beside_those_found(made):
    row = r"\| `period` \|  \| 7\.161378395771 \| 7\.161378395771 \| \d\.\de[+-]\d\d \| 1e-10 \|"
    assert re.search(row, (made / "pages/scenes/planar_hopf_cycle.md").read_text("utf-8"))
    oscillator = (made / "pages/oscillators/planar_hopf.md").read_text("utf-8")
    assert (
        "[Limit cycle after a discontinuous Hopf bifurcation](../scenes/planar_hopf_cycle.md) | `period`" in oscillator
    )
    assert "| `mu` | 1 | 1 | bifurcation parameter |" in oscillator


def test_a_system_of_the_literature_stands_in_one_table(made):
    text = (made / "pages/literature.md").read_text("utf-8")
    head = r"\| lotka volterra \| A turn from twice as much prey as it needs \| Volterra, Nature 118 \(1926\) "
    value = r"\| `period` \| 6\.608482671235 \| 6\.608482671235 \| \de-\d\d \| 1e-09 \| computed, mpmath: [^|]+\|\n"
    assert re.search(head + value + r"\|  \|  \|  \| `x_min` \| ", text)
    assert "1 published systems" in text and "their 4 known values" in text


def test_what_is_calibrated_stands_beside_the_truth(made):
    text = (made / "pages/calibrations/calibrated_pair.md").read_text("utf-8")
    assert re.search(r"\| `e` \| 0\.4 \| 0\.6 \| (0\.59|0\.60)\d+ ± 0\.0\d+ \| 0\.\d+ to 0\.\d+ \|", text)
    assert "--free D,A,e,phi0 --set D=8.0 --set A=1.4" in text
    assert imread(made / "pages/pictures/calibrated_pair.png").std() > 0.05


def test_a_calibration_that_misses_the_truth_stops_the_build(tmp_path):
    wrong = replace(PAIR, truth={"e": 0.6}, first={"e": 0.5, "D": 6.1})
    with pytest.raises(StickslipError, match=r"calibrated_pair: e is .* the truth is 0\.6"):
        make([], [], tmp_path / "pages", tmp_path / "live", [wrong])


def test_scenes_share_the_live_page_of_their_model_and_tell_it_their_values(made):
    assert [page.name for page in (made / "site/live").iterdir()] == ["planar_hopf.html"]
    text = (made / "pages/scenes/planar_hopf_cycle.md").read_text("utf-8")
    address, state = re.findall(r'<iframe class="live" src="([^"#]+)#([^"]+)"', text)[0]
    told = json.loads(unquote(state))
    assert address == "../live/planar_hopf.html"
    assert told["model"] == "planar_hopf" and told["set"] == {"mu": 1.0, "x1": 0.0, "x2": 2.0}


def test_the_live_page_in_a_page_moves_as_the_scene(browser, made):
    text = (made / "pages/scenes/planar_hopf_figure_2.md").read_text("utf-8")
    page = made / "site/scenes/planar_hopf_figure_2.html"
    page.parent.mkdir(exist_ok=True)
    page.write_text(re.findall(r"```\{raw\} html\n(.*?)```", text, re.S)[0], "utf-8")
    tab = browser.new_page()
    tab.goto(page.as_uri())
    frame = tab.query_selector("iframe").content_frame()
    frame.wait_for_function("globalThis.page && page.motion")
    assert frame.evaluate("document.getElementById('note').textContent") == ""
    first = frame.evaluate("[...page.motion.rows[0].slice(0, 3)]")
    assert first == [0.0, -1.5, 0.0]


def test_the_code_of_a_page_is_what_ran(made, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    text = (made / "pages/scenes/planar_hopf_cycle.md").read_text("utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.S)
    ran: dict[str, Any] = {}
    exec(code, ran)
    # not byte for byte: another process may round, and place text by a fraction of a pixel, otherwise
    told = re.findall(r"\| `(\w+)` \|  \| [^|]+ \| (\S+) \|", text)
    assert [name for name, _ in told] == ["period", "multiplier1", "multiplier2"]
    assert all(float(value) == pytest.approx(ran["rows"][0].values[name], rel=1e-9) for name, value in told)
    drawn, shown = (imread(folder / "planar_hopf_cycle.png") for folder in (tmp_path, made / "pages/pictures"))
    assert drawn.shape == shown.shape and drawn.std() == pytest.approx(shown.std(), rel=0.1)


def test_a_known_value_that_is_not_met_stops_the_build(tmp_path):
    right = find("planar_hopf_cycle").read_text("utf-8")
    wrong = tmp_path / "planar_hopf_cycle.toml"
    wrong.write_text(right.replace("\nperiod = 7.161378395771368995", "\nperiod = 7.1613784"), "utf-8")
    with pytest.raises(StickslipError, match=r"planar_hopf_cycle: period is 7\.161378395771, known is 7\.1613784, "):
        make([wrong], [], tmp_path / "pages", tmp_path / "live")
    assert not list(tmp_path.rglob("*.md"))


def test_figures_are_told_as_their_source_tells_them():
    assert figure_of("Leine and van Campen, equations (15), (16), figures 8 to 10") == "figures 8 to 10"
    assert figure_of("Casini, Nonlinear Dynamics 46 (2006), class a, Table 1") == "Table 1"
    assert figure_of("a study, Table 1, figure 6") == "figure 6"
    assert figure_of("Ding et al., figure 7; the basins are of this project") == "figure 7"
    assert figures_of("Ding et al., figures 4 to 6") == (4, 5, 6) and figures_of("figures 12 and 13; Glocker") == (
        12,
        13,
    )
    assert figures_of("figures 8, 9 and 15; the exponents") == (8, 9, 15)
    assert figures_of("a study, Table 1, figure 5 (d)") == (5,) and figures_of("Table 1") == ()
    assert figure_of("Lieberman and Lichtenberg, Physical Review A 5 (1972)") == ""


def test_a_bar_in_a_cell_does_not_end_it():
    assert r"| |x| |".replace("|x|", r"\|x\|") in table(["a"], [["|x|"]])
