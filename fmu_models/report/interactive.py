"""Families of motions as one page that needs nothing but itself: zoom, the parameters under the cursor, and, on a
click, the motion of that place in a frame."""

import html
import importlib.util
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import singledispatch
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmu_models.analyses.basins import Basins
from fmu_models.analyses.chart import Chart
from fmu_models.analyses.diagram import Diagram
from fmu_models.analyses.labels import UNLABELLED
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import checked_page, write_whole
from fmu_models.base.shown import Pictured, tell
from fmu_models.report.document import document, paragraph, section
from fmu_models.report.views import SWEEPS, attractors_of, classes_of, colours_of

PALE = "#FFFFFF"  # of what has no class
DIGITS = ".10g"
MANY = 10_000  # dots


# tells the frame the values of the place that was clicked; {plot_id} is plotly's
CLICK = """document.getElementById("{plot_id}").on("plotly_click", ({ points }) => {
  const { curveNumber, pointNumber, x, y } = points[0];
  const { state, axes, states, starts } = %s, place = { [axes[0]]: x };
  if (starts) starts[curveNumber][pointNumber].forEach((value, i) => (place[states[i]] = value));
  else place[axes[1]] = y;
  const text = JSON.stringify({ ...state, set: { ...state.set, ...place } });
  document.querySelector("iframe").contentWindow.postMessage(text, "*");
});"""


@dataclass(frozen=True)
class PickedMotion:
    """What a click shows. frame: of a page of `fmu_models.explorer`; model, version: as that page has them; values: by
    name, that hold in every cell."""

    frame: str
    model: str
    version: str
    values: Mapping[str, float]


def check_page(path: str | os.PathLike[str]) -> Path:
    """The path, if a page can be written there.

    Raises:
        StickslipError: another suffix than .html, or plotly is not installed.
    """
    target = checked_page(path, overwrite=True)
    if importlib.util.find_spec("plotly") is None:
        raise StickslipError("plotly is not installed. Install it: pip install 'stickslip[interactive]'")
    return target


def write_page(
    result: Pictured, path: str | os.PathLike[str], *, overwrite: bool = False, motion: PickedMotion | None = None
) -> Path:
    """Write a family as a page. motion: the one that a click shows below; none if None.

    Raises:
        StickslipError: as ``check_page``; there is none of such a value; or the file exists or cannot be written.
    """
    target = check_page(path)
    import plotly.graph_objects as graph

    drawn = traces(result)
    assert isinstance(result, Diagram | Chart | Basins)
    plot = graph.Figure(drawn, _layout(result)).to_html(
        full_html=False,
        include_plotlyjs=True,
        config={"displaylogo": False, "scrollZoom": True, "responsive": True},
        default_height="100%",
        post_script=None if motion is None else CLICK % _clicked(result, motion),
    )
    named = type(result).__name__.lower()
    main = [f'<div class="plot" role="group" aria-label="{named}: what it shows stands below">{plot}</div>']
    if motion is not None:
        main += [paragraph("A click above shows the motion of that place here."), motion.frame]
    main.append(section("words", "In words", [f"<pre>{html.escape(tell(result))}</pre>"], folded=motion is not None))
    text = document(result.model, f"{named} over {' and '.join(_axes(result))}", main, broad=True)
    with write_whole(target, overwrite=overwrite) as temporary:
        temporary.write_text(text, "utf-8")
    return target


def _clicked(result: Diagram | Chart | Basins, motion: PickedMotion) -> str:
    """What a click has to know, as JSON: a point of a diagram is a motion's own state, a cell names two values."""
    content: dict[str, Any] = {
        "state": {"model": motion.model, "version": motion.version, "set": dict(motion.values)},
        "axes": [result.over] if isinstance(result, Diagram) else list(result.axes),
    }
    if isinstance(result, Diagram):
        content["states"] = result.states
        places = (np.nonzero(np.isfinite(mask)) for mask in result.shown)
        content["starts"] = [points[indices].tolist() for points, indices in zip(result.points, places, strict=True)]
    return json.dumps(content).replace("</", "<\\/")


def _axes(result: Diagram | Chart | Basins) -> list[str]:
    """Names of what is drawn across and up, with units."""
    names = (result.over, result.of) if isinstance(result, Diagram) else tuple(result.axes)
    units = [result.units.get(name, "1") for name in names]
    return [name if unit in ("", "1") else f"{name} ({unit})" for name, unit in zip(names, units, strict=True)]


def _layout(result: Diagram | Chart | Basins) -> dict[str, Any]:
    across, up = _axes(result)
    return {
        "xaxis": {"title": {"text": across}},
        "yaxis": {"title": {"text": up}},
        "legend": {"orientation": "h", "yanchor": "bottom", "y": 1.01, "x": 0.0},
        "margin": {"l": 55, "r": 10, "t": 50, "b": 50},
        "template": "simple_white",
        "dragmode": "zoom",
        "hovermode": "closest",
    }


@singledispatch
def traces(result: object) -> list[dict[str, Any]]:
    """What is drawn of a family, as plotly has it."""
    raise StickslipError(f"There is no page of {type(result).__name__}. Draw it by --figure.")


@traces.register(Diagram)
def _(diagram: Diagram) -> list[dict[str, Any]]:
    """A dot per point, a trace per sweep."""
    figures = []
    for d, direction in enumerate(diagram.directions):
        visible = diagram.shown[d]
        m, r = np.nonzero(np.isfinite(visible))
        words = np.array([diagram.word(d, i) or "none" for i in range(len(diagram.values))], dtype=object)
        way, first = diagram.ways[d], diagram.ways[0]
        marker = {"color": SWEEPS[way], "size": (4, 2)[way != first]}
        dots = _dots(direction, diagram.values[m], visible[m, r], marker)
        template = f"{diagram.over} = %{{x:{DIGITS}}}<br>{diagram.of} = %{{y:{DIGITS}}}<br>motion %{{customdata}}"
        hover = {"customdata": words[m].tolist(), "hovertemplate": f"{template}<extra>{direction}</extra>"}
        figures.append(dots | hover)
    return figures


def _dots(name: str, x: NDArray[np.float64], y: NDArray[np.float64], marker: dict[str, Any]) -> dict[str, Any]:
    """A trace of dots; many of them by the graphics card, which not every browser may use."""
    pairs = {"x": x.tolist(), "y": y.tolist()}
    kind = "scattergl" if len(x) > MANY else "scatter"
    return {"type": kind, "mode": "markers", "name": name, **pairs, "marker": marker}


@traces.register(Basins)
def _(basins: Basins) -> list[dict[str, Any]]:
    """The grid, and the attractors on it."""
    if len(basins.axes) != 2:
        raise StickslipError(f"A page of basins is over two states, found {', '.join(basins.axes)}.")
    names = attractors_of(basins)
    figures = _grid(basins.axes, basins.labels, names, colours_of(names), "steps", basins.steps)
    limits = [(values.min(), values.max()) for values in basins.axes.values()]
    for name, colour, attractor in zip(names, colours_of(names), basins.attractors, strict=True):
        points = np.stack([attractor.points[:, basins.states.index(axis)] for axis in basins.axes], axis=1)
        inside = np.all([(low <= p) & (p <= high) for (low, high), p in zip(limits, points.T, strict=True)], axis=0)
        marker = {"color": colour, "size": 9 if attractor.period else 2, "line": {"color": "black", "width": 1.5}}
        figures.append(_dots(f"attractor {name}", points[inside, 0], points[inside, 1], marker) | {"showlegend": False})
    return figures


@traces.register(Chart)
def _(chart: Chart) -> list[dict[str, Any]]:
    names = [f"{chart.what} {name}" for name in classes_of(chart)]
    return _grid(chart.axes, chart.labels, names, colours_of(chart.classes), "value", chart.values)


def _grid(
    axes: Mapping[str, NDArray[np.float64]],
    labels: NDArray[np.int64],
    names: Sequence[str],
    colours: Sequence[str],
    behind: str,
    numbers: NDArray[Any],
) -> list[dict[str, Any]]:
    """Cells in the colours of their classes, what each is under the cursor, and a legend."""
    (name, x), (second, y) = axes.items()
    texts = {**dict(enumerate(names)), **UNLABELLED}
    shades = [PALE, *colours]
    steps = [(k + edge) / len(shades) for k in range(len(shades)) for edge in (0, 1)]
    cells = {
        "type": "heatmap",
        "x": x.tolist(),
        "y": y.tolist(),
        "z": np.maximum(labels, -1).T.tolist(),
        "zmin": -1.5,
        "zmax": len(colours) - 0.5,
        "colorscale": [[step, shades[i // 2]] for i, step in enumerate(steps)],
        "showscale": False,
        "text": [[texts[int(label)] for label in row] for row in labels.T],
        "customdata": [[None if np.isnan(number) else float(number) for number in row] for row in numbers.T],
        "hovertemplate": f"{name} = %{{x:{DIGITS}}}<br>{second} = %{{y:{DIGITS}}}<br>%{{text}}"
        f"<br>{behind} %{{customdata:{DIGITS}}}<extra></extra>",
    }
    legend = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": text,
            "x": [None],
            "y": [None],
            "marker": {"color": colour, "size": 12, "symbol": "square", "line": {"color": "grey", "width": 1}},
        }
        for text, colour in [
            *zip(names, colours, strict=True),
            *((text, PALE) for value, text in UNLABELLED.items() if (labels == value).any()),
        ]
    ]
    return [cells, *legend]
