"""One page of findings: self-contained HTML, figures as SVG in it, and the data as JSON at its end.

What a reader looks for comes first: the verdict, the values, a picture or two; the rest is folded.
"""

from __future__ import annotations

import datetime
import json
import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from html import escape
from pathlib import Path

from fmu_models.base.files import write_whole
from fmu_models.base.record import Recorded
from fmu_models.base.shown import Shown
from fmu_models.base.version import version
from fmu_models.report.document import bullets, document, paragraph, section


class Findings(Shown, Recorded, ABC):
    """What a page is made of: the result of one kind of identification, and what was compared with it. ``RECORD``: the
    data of the page."""

    @abstractmethod
    def title(self) -> str:
        """Of the page."""

    @abstractmethod
    def about(self) -> str:
        """How it was found, in a few words."""

    @abstractmethod
    def summary(self) -> list[str]:
        """What was found and how far it can be trusted, in sentences, the verdict first."""

    @abstractmethod
    def values(self) -> list[str]:
        """HTML of what speaks against it, the values and pictures, between the verdict and the other sentences."""

    @abstractmethod
    def sections(self) -> list[str]:
        """HTML between the summary and what to cite."""

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
    date = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC")
    verdict, *sentences = findings.summary()
    first = [paragraph(verdict, "verdict"), *findings.values(), bullets(sentences)]
    # "</" would end the element that holds it
    data = json.dumps(findings.to_dict(), ensure_ascii=False).replace("</", "<\\/")
    return document(
        findings.title(),
        f"{findings.about()}; stickslip {version()}, {date}",
        [*first, *findings.sections(), section("cite", "How to cite", [bullets(findings.citations())])],
        tail=f'<script type="application/json" id="data">{data}</script>\n',
    )


def warned(heading: str, sentences: Sequence[str]) -> list[str]:
    """Warnings below a heading of their own; nothing where there are none."""
    return [f"<h2>{escape(heading)}</h2>", bullets(sentences, "warning")] if sentences else []


def counted(kind: str, sentences: Sequence[str]) -> str:
    """How many verdicts or warnings stand below. kind: "verdict" or "warning"."""
    count = len(sentences)
    against = " against it" if kind == "verdict" else ""
    few = {0: f"There are no {kind}s{against}.", 1: f"There is one {kind} (below)."}
    return few.get(count, f"{count} {kind}s (below).")
