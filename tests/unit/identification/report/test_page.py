"""Names of files and models come from others: on a page they are text, whatever they hold."""

from __future__ import annotations

import re
from typing import Any

from fmu_models.report.document import section
from identification.report.page import Findings, page

EVIL = "<img src=x onerror=alert(1)></script>"


class Named(Findings):
    def to_dict(self) -> dict[str, Any]:
        return {"log": EVIL}

    def title(self) -> str:
        return EVIL

    def about(self) -> str:
        return EVIL

    def summary(self) -> list[str]:
        return [EVIL]

    def values(self) -> list[str]:
        return []

    def sections(self) -> list[str]:
        return [section("law", "Law", ["<p>open</p>"], folded=False), section("more", "More", ["<p>deep</p>"])]

    def citations(self) -> list[str]:
        return [EVIL]


def test_what_others_wrote_is_no_markup() -> None:
    text = page(Named())
    shown, data = text.split('type="application/json"', 1)
    assert "<img" not in shown and shown.count("&lt;img") >= 3
    assert "</script>" not in data.split("onerror", 1)[1].split("}", 1)[0]


def test_what_a_reader_opens_is_folded_with_its_heading_shown() -> None:
    text = page(Named())
    more = text.split('<section id="more">')[1].split("</section>")[0]
    assert re.sub(r">\s+<", "><", more.strip()) == ("<details><summary><h2>More</h2></summary><p>deep</p></details>")
    assert "<details" not in text.split('<section id="law">')[1].split("</section>")[0]
    assert re.search(r"@media print {\s+details::details-content { content-visibility: visible;", text)
