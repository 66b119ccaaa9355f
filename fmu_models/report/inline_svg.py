"""A figure as SVG inside a page."""

from __future__ import annotations

import io
import re
from html import escape
from typing import TYPE_CHECKING

from fmu_models.base.figures import part_ticks

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SMALLEST = 12.0  # px


def inline_svg(figure: Figure, prefix: str, title: str) -> str:
    """SVG of a figure to be put into HTML. prefix: of its ids, so that several figures share a page; title: read out to
    those who do not see it."""
    from matplotlib import rc_context

    part_ticks(figure)
    buffer = io.StringIO()
    # text stays text: smaller, searchable, and in the font of the page
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": prefix}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    svg = buffer.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.S)
    svg = re.sub(r"<(?:path|use)\b[^>]*>", _shortened, svg)
    svg = re.sub(r'\bid="', f'id="{prefix}-', svg)
    svg = re.sub(r'(xlink:href="#|url\(#)', rf"\1{prefix}-", svg)
    svg = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", svg, count=1)
    head, end, body = svg.partition(">")
    attributes = f'style="min-width: {_least(figure, body):.0f}px" role="img" aria-label="{escape(title)}"'
    return f"{head} {attributes}{end}{body.strip()}"


def _least(figure: Figure, body: str) -> float:
    """Pixels across from which on all texts are as large as `SMALLEST`, but for exponents and indices."""
    sizes = [float(size) for size in re.findall(r'<text style="font-size: ([\d.]+)px', body)]
    return SMALLEST * 72.0 * figure.get_figwidth() / min(sizes, default=SMALLEST)


def _shortened(tag: re.Match[str]) -> str:
    """A drawn line or mark with places to hundredths of a point, which is below what any paper shows."""
    return re.sub(r'(?<= )(d|x|y)="([^"]*)"', lambda number: re.sub(r"(\.\d\d)\d+", r"\1", number[0]), tag[0])
