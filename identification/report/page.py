"""One page of findings: self-contained HTML, figures as SVG in it, and the data as JSON at its end."""

from __future__ import annotations

import datetime
import json
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fmu_models.base.files import write_whole
from fmu_models.base.shown import Shown
from fmu_models.base.version import version
from fmu_models.report.inline_svg import inline_svg
from identification.report.tables import shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TEMPLATE = "page.html.j2"


@dataclass(frozen=True)
class PageSection:
    """Of a page. name: its id; parts: HTML of what follows its heading; folded: until a reader opens or prints it."""

    name: str
    heading: str
    parts: Sequence[str]
    folded: bool = False


class Findings(Shown, ABC):
    """What a page is made of: the result of one kind of identification, and what was compared with it."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The data of the page, plain values."""

    @abstractmethod
    def title(self) -> str:
        """Of the page."""

    @abstractmethod
    def about(self) -> str:
        """How it was found, in a few words."""

    @abstractmethod
    def summary(self) -> list[str]:
        """What was found and how far it can be trusted, in sentences."""

    @abstractmethod
    def values(self) -> list[str]:
        """HTML of the values and what speaks against them, below the summary."""

    @abstractmethod
    def sections(self) -> list[PageSection]:
        """Between the summary and what to cite."""

    @abstractmethod
    def citations(self) -> list[str]:
        """One sentence each."""


def write_report(findings: Findings, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write the page of what ``findings`` gathered.

    Raises:
        StickslipError: ``path`` exists and ``overwrite`` is false, or cannot be written.
    """
    text = page(findings)
    with write_whole(path, overwrite=overwrite) as temporary:
        temporary.write_text(text, "utf-8")
    return Path(path)


def page(findings: Findings) -> str:
    """The page as text."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("identification.report"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    summary = PageSection("summary", "Summary", [bullets(findings.summary()), *findings.values()])
    return environment.get_template(TEMPLATE).render(
        title=findings.title(),
        about=findings.about(),
        sections=[summary, *findings.sections()],
        citations=findings.citations(),
        version=version(),
        date=datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
        # "</" would end the element that holds it
        data=json.dumps(findings.to_dict(), ensure_ascii=False).replace("</", "<\\/"),
    )


def drawing(figure: Figure, prefix: str, caption: str) -> str:
    """A figure for a page. prefix: of its ids there."""
    return f"<figure>{inline_svg(figure, prefix, caption)}<figcaption>{escape(caption)}</figcaption></figure>"


def bullets(sentences: Sequence[str], kind: str = "") -> str:
    """A list of sentences. kind: "warning" or ""."""
    mark = f' class="{kind}"' if kind else ""
    items = "\n".join(f"<li{mark}>{escape(sentence)}</li>" for sentence in sentences)
    return f"<ul>\n{items}\n</ul>" if sentences else ""


def warned(heading: str, sentences: Sequence[str]) -> list[str]:
    """Warnings below a heading of their own; nothing where there are none."""
    return [f"<h3>{escape(heading)}</h3>", bullets(sentences, "warning")] if sentences else []


def counted(kind: str, sentences: Sequence[str]) -> str:
    """How many verdicts or warnings stand below. kind: "verdict" or "warning"."""
    count = len(sentences)
    against = " against it" if kind == "verdict" else ""
    few = {0: f"There are no {kind}s{against}.", 1: f"There is one {kind} (below)."}
    return few.get(count, f"{count} {kind}s (below).")


def paragraph(text: str, kind: str = "") -> str:
    """Of text. kind: "about" for what explains a table, or ""."""
    mark = f' class="{kind}"' if kind else ""
    return f"<p{mark}>{escape(text)}</p>"


def nested(value: object) -> str:
    """A plain value as HTML: objects as definitions, lists of objects as tables, texts as lists."""
    if isinstance(value, Mapping):
        pairs = (
            f"<dt>{escape(key.replace('_', ' '))}</dt><dd>{nested(item)}</dd>"
            for key, item in value.items()
            if item is not None
        )
        return "<dl>\n" + "\n".join(pairs) + "\n</dl>"
    if isinstance(value, list | tuple) and value and isinstance(value[0], Mapping):
        heads = "".join(f'<th scope="col">{escape(key.replace("_", " "))}</th>' for key in value[0])
        rows = ("<tr>" + "".join(f"<td>{escape(shown(item))}</td>" for item in row.values()) + "</tr>" for row in value)
        body = "".join(rows)
        return f'<div class="wide"><table>\n<thead><tr>{heads}</tr></thead>\n<tbody>{body}</tbody></table></div>'
    if isinstance(value, list | tuple) and value and isinstance(value[0], str):
        return bullets(value)
    return escape(shown(value))
