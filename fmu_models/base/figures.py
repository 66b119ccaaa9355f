"""Figures as files, whole or not at all."""

from __future__ import annotations

import html
import json
import os
import re
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import refuse_existing, write_whole

if TYPE_CHECKING:
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

MOST_TICKS = 7  # where those that matplotlib chooses touch
SPACED = 0.4  # heights of a label between labels side by side
FORMATS = (".svg", ".png", ".pdf")
SPANNED = re.compile(r'<spanned xmlns="stickslip">(.*?)</spanned>', re.DOTALL)  # in the metadata of an SVG


class Spanned(NamedTuple):
    """Names of what the axes of a picture show, and which of a model's names a place in it gives values of."""

    x: str
    y: str
    parameters: tuple[str, ...] = ()
    states: tuple[str, ...] = ()


def check_format(path: str | os.PathLike[str]) -> Path:
    """The path, if it is one of a figure. StickslipError: unknown suffix."""
    target = Path(path)
    if target.suffix.lower() not in FORMATS:
        raise StickslipError(f"'{target.name}' has no known format; end it in one of {', '.join(FORMATS)}.")
    return target


def check_files(*files: str | os.PathLike[str] | None, figures: Iterable[Path | None], overwrite: bool = False) -> None:
    """Refuse before the work what could not be written after it; None stands for what is not asked for. StickslipError:
    a file or figure exists and ``overwrite`` is false, or a figure has an unknown suffix."""
    drawn = [figure for figure in figures if figure is not None]
    refuse_existing(*files, *drawn, overwrite=overwrite)
    for figure in drawn:
        check_format(figure)


def part_ticks(figure: Figure) -> None:
    """Take fewer ticks where their labels touch one another."""
    from matplotlib.ticker import AutoLocator, MaxNLocator

    figure.draw_without_rendering()
    for axes in figure.axes:
        for axis, along in ((axes.xaxis, 0), (axes.yaxis, 1)):
            for ticks in range(MOST_TICKS, 1, -1):
                if not isinstance(axis.get_major_locator(), AutoLocator | MaxNLocator) or not _touch(axis, along):
                    break
                axis.set_major_locator(MaxNLocator(ticks))
                figure.draw_without_rendering()


def _touch(axis: Axis, along: int) -> bool:
    """Whether labels of ticks that are shown touch; along: 0 for x, 1 for y."""
    low, high = sorted(axis.get_view_interval())
    boxes = [
        label.get_window_extent()
        for tick in axis.get_major_ticks()
        for label in (tick.label1, tick.label2)
        if label.get_visible() and label.get_text() and low <= tick.get_loc() <= high
    ]
    spans = sorted((box.x0, box.x1) if along == 0 else (box.y0, box.y1) for box in boxes)
    gap = SPACED * max((box.height for box in boxes), default=0.0) if along == 0 else 0.0
    return any(first[1] + gap > second[0] for first, second in pairwise(spans))


def save_figure(
    figure: Figure, path: str | os.PathLike[str], *, overwrite: bool = False, spanned: Spanned | None = None
) -> Path:
    """Write a figure whole; the format follows the suffix (.svg, .png, .pdf). spanned: by the first axes; an SVG keeps
    it for ``read_spanned``. StickslipError: unknown suffix, the file exists, or its folder cannot be written."""
    from matplotlib import rc_context

    target = check_format(path)
    part_ticks(figure)
    # text stays text, which can be searched and changed
    as_text = rc_context({"svg.fonttype": "none", "pdf.fonttype": 42})
    with write_whole(target, overwrite=overwrite) as temporary, as_text:
        figure.savefig(temporary, format=target.suffix.lower()[1:], dpi=150)
        if spanned is not None and target.suffix.lower() == ".svg":
            _keep_spanned(figure, spanned, temporary)
    return target


def _keep_spanned(figure: Figure, spanned: Spanned, path: Path) -> None:
    """Write into the metadata of an SVG what the figure, as it was drawn there, spans."""
    axes = figure.axes[0]
    box = axes.get_position()
    content = {**spanned._asdict(), "box": [box.x0, 1.0 - box.y0, box.x1, 1.0 - box.y1]}
    content["limits"] = [list(map(float, limits)) for limits in (axes.get_xlim(), axes.get_ylim())]
    entry = f'<spanned xmlns="stickslip">{html.escape(json.dumps(content), quote=False)}</spanned>'
    path.write_text(path.read_text("utf-8").replace("</metadata>", f"{entry}\n </metadata>", 1), "utf-8")


def read_spanned(path: Path) -> dict[str, Any] | None:
    """What the axes of an SVG span: the fields of ``Spanned``; ``box``, the left, lower, right and upper edge as shares
    of the picture from its upper left corner; ``limits``, values at the edges of x and of y. None: it does not say."""
    found = SPANNED.search(path.read_text("utf-8", "replace"))
    return json.loads(html.unescape(found[1])) if found else None
