"""The page of `stickslip explore` in a browser: what it computes, draws and says, and that it asks for nothing."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread
from some_nightly import some_nightly

from fmu_models.explorer.page import explore
from fmu_models.fmu.load import load
from fmu_models.scene.read import read_scene
from fmu_models.simulation.run import simulate

MODEL = "forced_stick_slip"


@pytest.fixture(scope="module")
def belt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return explore(MODEL).write(tmp_path_factory.mktemp("page") / "belt.html")


class Opened:
    """A page that is open, what it asked for and what it complained of."""

    def __init__(self, browser: Any, address: str, width: int = 1400, **context: Any) -> None:
        self.tab = browser.new_context(viewport={"width": width, "height": 900}, **context).new_page()
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self.tab.on("request", lambda request: self.requests.append(request.url))
        self.tab.on("console", lambda message: self.complaints.append(message.text))
        self.tab.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.tab.goto(address)

    def ready(self) -> Opened:
        self.tab.wait_for_selector("#readout dd")
        self.tab.wait_for_timeout(50)
        self.settled()
        return self

    def settled(self) -> None:
        """Until the run is known to its end."""
        for _ in range(200):
            if self.tab.evaluate("page.motion.complete"):
                return
            self.tab.wait_for_timeout(20)
        raise AssertionError("the run does not end")

    def read(self) -> dict[str, str]:
        names, values = (self.tab.locator(f"#readout {tag}").all_inner_texts() for tag in ("dt", "dd"))
        return dict(zip(names, values, strict=True))

    def sets(self, name: str, value: str) -> None:
        entry = self.tab.get_by_label(f"value of {name}", exact=True)
        entry.fill(value)
        entry.press("Enter")
        self.settled()


@pytest.fixture(scope="module")
def opened(browser: Any, belt: Path) -> Opened:
    return Opened(browser, belt.as_uri()).ready()


@pytest.mark.smoke
@pytest.mark.parametrize("width", some_nightly([360, 1400], [1400]))
def test_its_curve_goes_through_the_points_that_the_suite_computes(browser: Any, belt: Path, width: int):
    page = Opened(browser, belt.as_uri(), width).ready()
    assert {one for one in page.requests if not one.startswith("blob:")} == {belt.as_uri()} and page.complaints == []
    tab = page.tab
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    time, x, v = np.array(tab.evaluate("page.motion.rows.slice(page.motion.from).map((row) => [...row.slice(0, 3)])")).T
    known = simulate(load(MODEL), float(time[-1]), output_times=time)
    assert max(np.abs(x - known["x"]).max(), np.abs(v - known["v"]).max()) < 1e-9
    # a pixel that is not ground within two of each computed point, and ground between them
    seen = tab.evaluate(
        """([xs, vs]) => {
          const picture = page.pictures.portrait, canvas = picture.canvas, context = canvas.getContext("2d");
          const ground = [...context.getImageData(1, 1, 1, 1).data].join();
          const drawn = (u, w) => {
            const data = context.getImageData(u - 2, w - 2, 5, 5).data;
            for (let i = 0; i < data.length; i += 4) if (data.slice(i, i + 4).join() !== ground) return true;
            return false;
          };
          const { left, right, top, bottom } = picture.plane, [x0, x1] = picture.x, [v0, v1] = picture.y;
          const place = (part, from, to) => from + part * (to - from);
          const there = (x, v) =>
            drawn(place((x - x0) / (x1 - x0), left, right), place((v - v0) / (v1 - v0), bottom, top));
          return [xs.map((x, i) => there(x, vs[i])), there(1.1, 0.2)];
        }""",
        [known["x"][::20].tolist(), known["v"][::20].tolist()],
    )
    assert all(seen[0]) and not seen[1]
    assert page.read()["period"].startswith("2 strobes, 7.85398163 s") and page.read()["n-p-q word"] == "2-1"
    assert page.read()["belt sticks"] == "8.594 %"  # 0.675 s of 7.854 s


def test_everything_has_a_name_and_follows_the_keyboard(opened: Opened):
    tab = opened.tab
    unnamed = tab.evaluate(
        """() => [...document.querySelectorAll("input, select, button, textarea, canvas")].filter((one) =>
          !one.getAttribute("aria-label") && !one.textContent.trim() && !(one.labels && one.labels.length))
          .map((one) => one.id)"""
    )
    assert unnamed == []
    slider = tab.get_by_label("omega: angular frequency of the force, rad/s", exact=True)
    before, stop = opened.read(), int(slider.input_value())
    slider.focus()
    slider.press("ArrowRight")
    opened.settled()
    assert int(slider.input_value()) == stop + 1 and opened.read() != before
    value = float(tab.get_by_label("value of omega", exact=True).input_value())
    assert value == pytest.approx(4.8 * (stop + 1) / 1000, rel=1e-5)
    slider.press("Home")
    opened.settled()
    assert float(tab.get_by_label("value of omega", exact=True).input_value()) == 0.0
    opened.sets("omega", "nonsense")
    assert "'nonsense' is not a number; omega stays as it is" in tab.inner_text("#note")
    opened.sets("m", "0")
    assert "m must be > 0 kg (mass of the block)" in tab.inner_text("#refusal")
    tab.click("#defaults")
    opened.settled()
    assert not tab.is_visible("#refusal") and opened.read() == before and opened.complaints == []


def test_a_click_starts_there_and_the_address_keeps_it(browser: Any, opened: Opened):
    tab = opened.tab
    tab.locator("#portrait").click(position={"x": 150, "y": 100})
    opened.sets("a0", "1.7")
    tab.wait_for_timeout(300)
    again = Opened(browser, tab.url).ready()
    state = json.loads(tab.input_value("#state"))
    assert set(state["set"]) == {"x", "v", "a0"} and json.loads(again.tab.input_value("#state")) == state
    rows = "page.motion.rows.map((row) => [...row])"
    assert tab.evaluate(rows) == again.tab.evaluate(rows)
    tab.fill("#state", '{"model": "pendulum"}')
    tab.click("#apply")
    assert "it is of the model 'pendulum'" in tab.inner_text("#note")
    # what is no section, plane or length is not taken; all else is
    odd = {**state, "section": {"state": 99, "level": None}, "plane": 7, "series": "x", "until": "long"}
    for text in (json.dumps(odd), json.dumps(state)):
        tab.fill("#state", text)
        tab.click("#apply")
        opened.settled()
    assert tab.evaluate(rows) == again.tab.evaluate(rows) and opened.complaints == []


def test_its_command_and_its_scene_give_the_same_motion(opened: Opened, tmp_path: Path):
    tab = opened.tab
    tab.click("#defaults")
    opened.sets("f0", "0.2")
    opened.sets("v_dr", "0.9")
    line = shlex.split(tab.input_value("#command"))
    assert (
        line[:3] == ["stickslip", "simulate", MODEL] and "f0=0.2" in line and "v_dr=0.9" in line and "m=1" not in line
    )
    code = "from identification.cli import main; main()"
    run = subprocess.run([sys.executable, "-c", code, *line[1:], "--json"], capture_output=True, text=True, check=True)
    ranges = json.loads(run.stdout)["ranges"]
    last = tab.evaluate("[...page.motion.rows.at(-1)]")
    assert [ranges[name]["end"] for name in ("x", "v")] == pytest.approx(last[1:3], abs=1e-9)
    (tmp_path / "same.toml").write_text(tab.input_value("#scene"))
    scene = read_scene(tmp_path / "same.toml")
    assert scene.free == {"f0": 0.2} and scene.drives["v_dr"].constant == 0.9 and scene.stop_time == last[0]


def test_a_diagram_is_computed_in_workers_and_a_click_in_it_moves_the_parameter(opened: Opened):
    tab = opened.tab
    tab.click("#defaults")
    for box, value in (("#over", {"label": "omega"}), ("#from", "1.5"), ("#to", "1.7"), ("#count", "21")):
        if isinstance(value, dict):
            tab.select_option(box, **value)
        else:
            tab.fill(box, value)
    tab.click("#sweep")
    tab.wait_for_selector("#progress:has-text('21 of 21 values in')")
    assert any(address.startswith("blob:") for address in opened.requests)
    middle = np.array(tab.evaluate("page.swept.points.get(10).map((point) => [...point])"))
    section = np.array(tab.evaluate("page.motion.points.slice(-2).map((row) => [...row.slice(1, 3)])"))
    # of the motion at the default frequency: one of its two points after the other
    assert min(np.abs(middle[-1] - one).max() for one in section) < 1e-5
    assert min(np.abs(middle[-2] - one).max() for one in section) < 1e-5
    box = tab.locator("#sweeps").bounding_box()
    tab.locator("#sweeps").click(position={"x": 62 + (box["width"] - 72) / 4, "y": 100})
    assert float(tab.get_by_label("value of omega", exact=True).input_value()) == pytest.approx(1.55, abs=2e-3)
    assert opened.complaints == []


def test_what_it_draws_is_saved_as_svg(opened: Opened, tmp_path: Path):
    with opened.tab.expect_download() as download:
        opened.tab.get_by_label("save phase portrait as SVG").click()
    download.value.save_as(tmp_path / "portrait.svg")
    text = (tmp_path / "portrait.svg").read_text()
    assert text.startswith("<svg") and "x (m)" in text and text.count("<path") >= 4


def test_what_it_draws_is_saved_as_png(opened: Opened, tmp_path: Path):
    with opened.tab.expect_download() as download:
        opened.tab.get_by_label("save time series as PNG").click()
    download.value.save_as(tmp_path / "series.png")
    picture = imread(tmp_path / "series.png")
    size = opened.tab.evaluate("(({ width, height }) => [height, width])(page.pictures.series.canvas)")
    assert list(picture.shape[:2]) == size and np.ptp(picture[:, :, :3], axis=(0, 1)).min() > 0.1


def test_nothing_moves_by_itself_where_that_is_asked_for(browser: Any, belt: Path):
    moves = """[...document.querySelectorAll("*")].filter((one) => {
      const { transitionDuration, animationName, scrollBehavior } = getComputedStyle(one);
      return parseFloat(transitionDuration) > 0 || animationName !== "none" || scrollBehavior !== "auto";
    }).length"""
    found = {}
    for asked in ("reduce", "no-preference"):
        page = Opened(browser, belt.as_uri(), reduced_motion=asked).ready()
        found[asked] = page.tab.evaluate(moves)
        assert page.tab.evaluate("document.getAnimations().length") == 0
        page.tab.close()
    assert found["reduce"] == 0 < found["no-preference"]


def test_without_webassembly_it_shows_a_picture_and_says_why(browser: Any, belt: Path):
    tab = browser.new_context().new_page()
    tab.add_init_script("delete globalThis.WebAssembly")
    tab.goto(belt.as_uri())
    assert "cannot be computed here: this browser has no WebAssembly." in tab.inner_text("#why")
    assert tab.is_visible("#still svg") and not tab.is_visible("#live")


def test_without_scripts_it_shows_a_picture_and_says_why(browser: Any, belt: Path):
    page = Opened(browser, belt.as_uri(), java_script_enabled=False)
    assert page.tab.is_visible("#still svg") and not page.tab.is_visible("#live")
    assert "where JavaScript and WebAssembly are on" in page.tab.inner_text("#why")
    assert len(belt.read_bytes()) < 120_000


def test_a_notebook_shows_it_in_a_frame(browser: Any):
    made = explore("woodpecker")
    page = Opened(browser, "about:blank")
    page.tab.set_content(made._repr_html_())
    frame = page.tab.frame_locator("iframe")
    # the period-1 motion of the default, once the run has come to its end
    frame.locator("#readout dd:has-text('1 crossing, 0.14597')").wait_for()
    frame.locator("#count").fill("4")
    frame.locator("#sweep").click()
    frame.locator("#progress:has-text('4 of 4 values in')").wait_for()
    assert page.complaints == [] and len(made.html.encode()) < 120_000
