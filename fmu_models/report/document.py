"""A page in one file: its frame and style, which all pages of the suite share, and what stands in it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from fmu_models.base.table import scrolling
from fmu_models.base.version import version
from fmu_models.report.inline_svg import inline_svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STYLE = Path(__file__).parent / "page.css"
GLANCE = (3.7, 3.4)  # inches of a figure that a telephone shows whole
LETTERS = 12.0  # points


def document(
    title: str, about: str, main: Sequence[str], *, head: str = "", tail: str = "", broad: bool = False
) -> str:
    """A page as text, which asks the network for nothing.

    Args:
        title, about: plain texts: its heading, and what stands small below it.
        main: HTML of what it says.
        head, tail: HTML at the end of its head and of its body.
        broad: it is as broad as the window; else as broad as lines are read well.
    """
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="stickslip {version()}">
<meta name="color-scheme" content="light dark">
<title>{escape(title)}</title>
<style>
{STYLE.read_text("utf-8")}</style>
{head}</head>
<body{' class="broad"' if broad else ""}>
<header>
<h1>{escape(title)}</h1>
<p class="about">{escape(about)}</p>
</header>
<main>
{chr(10).join(main)}
</main>
{tail}</body>
</html>
"""


def section(name: str, heading: str, parts: Sequence[str], *, folded: bool = True) -> str:
    """Of a page. name: its id; parts: HTML of what follows its heading; folded: until a reader opens or prints it."""
    begin, between, end = ("<details><summary>", "</summary>", "</details>") if folded else ("", "", "")
    content = "\n".join(parts)
    return f'<section id="{name}">{begin}<h2>{escape(heading)}</h2>{between}\n{content}\n{end}</section>'


def drawing(figure: Figure, prefix: str, caption: str) -> str:
    """A figure for a page. prefix: of its ids there."""
    drawn = scrolling(inline_svg(figure, prefix, caption), caption)
    return f"<figure>{drawn}<figcaption>{escape(caption)}</figcaption></figure>"


def glance(panels: Sequence[tuple[Callable[[Axes], None], str]]) -> str:
    """Small figures side by side, or below one another where there is no room. panels: what draws in given axes, and a
    caption."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    figures = []
    for place, (draw, caption) in enumerate(panels):
        with rc_context({"font.size": LETTERS}):
            figure = Figure(figsize=GLANCE, layout="constrained")
            draw(figure.add_subplot())
            figures.append(drawing(figure, f"glance{place}", caption))
    return f'<div class="glance">{"".join(figures)}</div>'


def bullets(sentences: Sequence[str], kind: str = "") -> str:
    """A list of sentences. kind: "warning" or ""."""
    mark = f' class="{kind}"' if kind else ""
    items = "\n".join(f"<li{mark}>{escape(sentence)}</li>" for sentence in sentences)
    return f"<ul>\n{items}\n</ul>" if sentences else ""


def paragraph(text: str, kind: str = "") -> str:
    """Of text. kind: "about" for what explains a table, "verdict", or ""."""
    mark = f' class="{kind}"' if kind else ""
    return f"<p{mark}>{escape(text)}</p>"
