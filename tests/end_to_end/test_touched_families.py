"""Pages of families in a browser: a click on a cell or a point shows the motion that was computed there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fmu_models.fmu.load import load
from fmu_models.simulation.run import simulate

MODEL = "forced_stick_slip"


def clicked(browser: Any, page: Path, trace: int, point: int | list[int]) -> dict[str, Any]:
    """The state and the rows of the motion after a click of the mouse on a point of a trace."""
    tab = browser.new_page(viewport={"width": 1200, "height": 900})
    complaints, requests = [], []
    tab.on("pageerror", lambda error: complaints.append(str(error)))
    tab.on("request", lambda request: requests.append(request.url))
    tab.goto(page.as_uri())
    tab.frame_locator("iframe").locator("#readout dd").first.wait_for()
    u, v = tab.evaluate(
        """([trace, point]) => {
          const plot = document.querySelector(".js-plotly-plot"), { xaxis, yaxis } = plot._fullLayout;
          const { x, y } = plot.data[trace], box = plot.getBoundingClientRect();
          const [a, b] = Array.isArray(point) ? [x[point[1]], y[point[0]]] : [x[point], y[point]];
          return [box.left + xaxis._offset + xaxis.d2p(a), box.top + yaxis._offset + yaxis.d2p(b)];
        }""",
        [trace, point],
    )
    tab.mouse.move(u, v)
    tab.wait_for_selector(".hoverlayer .hovertext")
    hover = tab.locator(".hoverlayer .hovertext").first.text_content()
    tab.mouse.click(u, v)
    frame = tab.frames[1]
    for _ in range(100):
        if frame.evaluate("JSON.parse(page.json()).set.x !== undefined && page.motion.complete"):
            break
        tab.wait_for_timeout(20)
    found = frame.evaluate(
        "({ state: JSON.parse(page.json()), rows: page.motion.rows.map((row) => [...row]), "
        "points: page.motion.points.map((row) => [...row]) })"
    )
    note = frame.inner_text("#note")
    tab.close()
    # workers of the diagram below come from the page itself
    assert complaints == [] and note == "" and [one for one in requests if "blob:" not in one] == [page.as_uri()]
    return {**found, "hover": hover}


def test_a_cell_of_basins_starts_the_motion_there(browser: Any, stickslip, tmp_path: Path):
    grid = ("--over", "x=0.5:1.5:3", "--over", "v=-0.4:0.4:3")
    answer = stickslip(
        "basins", MODEL, "--forcing", "omega", "--set", "a0=1.6", *grid, "--interactive", "b.html", "--json"
    )
    assert answer.code == 0, answer.err
    found = clicked(browser, tmp_path / "b.html", 0, [2, 0])
    assert "x = 0.5" in found["hover"] and "v = 0.4" in found["hover"]
    assert found["state"]["set"] == {"a0": 1.6, "x": 0.5, "v": 0.4}
    time, x = np.array([row[:2] for row in found["rows"]]).T
    start = {"x": 0.5, "v": 0.4}
    known = simulate(load(MODEL), time[-1], output_times=time, start=start, parameters={"a0": 1.6})
    assert np.abs(x - known["x"]).max() < 1e-9


def test_a_point_of_a_diagram_is_on_its_motion_from_the_begin(browser: Any, stickslip, tmp_path: Path):
    over = ("--over", "omega=1.6:1.7:2", "--of", "x")
    answer = stickslip("diagram", MODEL, "--forcing", "omega", *over, "--interactive", "d.html")
    assert answer.code == 0, answer.err
    found = clicked(browser, tmp_path / "d.html", 0, 0)
    state = found["state"]["set"]
    assert set(state) == {"x", "v"}  # omega = 1.6 is the default
    here = np.array([state["x"], state["v"]])
    assert found["rows"][0][1:3] == here.tolist()
    # a motion of two strobes, on it from the begin: every other strobe is the point that was clicked
    away = np.abs(np.array(found["points"])[:, 1:3] - here).max(axis=1)
    assert away[::2].max() < 1e-5 < 0.1 < away[1::2].min() and f"x = {here[0]:.10g}"[:10] in found["hover"]
