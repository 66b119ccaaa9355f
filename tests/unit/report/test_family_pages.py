"""Pages and pictures of families: self-contained, the values under the cursor those that were computed."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import PathCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from fmu_models import maps
from fmu_models.analyses.basins import Basins, basins
from fmu_models.analyses.chart import chart
from fmu_models.analyses.diagram import orbit_diagram
from fmu_models.analyses.lyapunov import lyapunov
from fmu_models.base.errors import StickslipError
from fmu_models.report.interactive import traces, write_page
from fmu_models.report.views import SWEEPS
from fmu_models.sections.iteration import Iteration

HENON = Iteration.of(maps.load("henon"))


@pytest.fixture(scope="module")
def grid() -> Basins:
    return basins(HENON.at(a=0.2), x=np.linspace(-40.0, 40.0, 5), y=np.linspace(-3.0, 3.0, 7))


def test_a_page_needs_nothing_but_itself(tmp_path: Path, grid: Basins) -> None:
    text = write_page(grid, tmp_path / "b.html").read_text("utf-8")
    scripts = re.findall(r"<script([^>]*)>", text)
    assert scripts and not any("src" in attributes for attributes in scripts)
    outside = re.sub(r"<script[^>]*>.*?</script>", "", text, flags=re.S)
    assert "href" not in outside and "src=" not in outside and "<title>henon</title>" in outside
    # the data of the page are those of the family
    assert json.dumps(grid.axes["y"].tolist()).replace(" ", "") in text.replace(" ", "")
    with pytest.raises(StickslipError, match="exists"):
        write_page(grid, tmp_path / "b.html")
    with pytest.raises(StickslipError, match=r"end it in \.html"):
        write_page(grid, tmp_path / "b.png")
    with pytest.raises(StickslipError, match="--figure"):
        write_page(lyapunov(HENON, periods=100, transient=10), tmp_path / "l.html")
    assert [path.name for path in tmp_path.iterdir()] == ["b.html"]


def test_cells_say_their_class_under_the_cursor(grid: Basins) -> None:
    cells = traces(grid)[0]
    assert np.array(cells["z"]).T.tolist() == np.maximum(grid.labels, -1).tolist()
    assert np.array(cells["customdata"]).T.tolist() == grid.steps.tolist()
    said = np.array(cells["text"]).T
    assert (said[grid.labels == -2] == "to infinity").all() and (grid.labels == -2).any()
    assert all(text.startswith("1 (") for text in said[grid.labels == 0])
    periods = chart(HENON, a=[0.2, 0.6, 1.4], b=[0.3, 0.31], transient=500)
    cells, *legend = traces(periods)
    assert [one["name"] for one in legend] == ["period none found", "period 1", "period 2"]
    assert cells["hovertemplate"].startswith("a = %{x:.10g}<br>b = %{y:.10g}<br>%{text}")


def test_sweeps_are_told_apart() -> None:
    found = orbit_diagram(HENON, "a", np.linspace(0.1, 1.0, 10), direction="both", transient=200)
    up, down = traces(found)
    assert up["marker"]["color"] != down["marker"]["color"] and up["marker"]["size"] > down["marker"]["size"]
    assert len(up["x"]) == np.isfinite(found.shown[0]).sum() and up["customdata"][0] == "1"
    first, second = found.plot(Figure().subplots()).collections
    assert isinstance(first, PathCollection) and isinstance(second, PathCollection)
    assert [to_hex(sweep.get_cmap()(1.0)) for sweep in (first, second)] == [to_hex(c) for c in SWEEPS.values()]
    assert first.get_sizes()[0] > 2 * second.get_sizes()[0]
    with pytest.raises(StickslipError, match="no state 'z'"):
        orbit_diagram(HENON, "a", [0.1], of="z")


def test_what_has_no_class_is_hatched(grid: Basins) -> None:
    labels = grid.labels.copy()
    labels[0, :3] = -1
    axes = replace(grid, labels=labels).plot(Figure().subplots())
    hatches = [one.get_hatch() for one in axes.collections if one.get_hatch()]
    assert hatches == ["////", "...."]
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()][-2:] == ["undecided", "to infinity"]
