"""Names of files and models come from others: on a page they are text, whatever they hold."""

from __future__ import annotations

from typing import Any

from identification.report.page import Findings, PageSection, page

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

    def sections(self) -> list[PageSection]:
        return []

    def citations(self) -> list[str]:
        return [EVIL]


def test_what_others_wrote_is_no_markup() -> None:
    text = page(Named())
    shown, data = text.split('type="application/json"', 1)
    assert "<img" not in shown and shown.count("&lt;img") >= 3
    assert "</script>" not in data.split("onerror", 1)[1].split("}", 1)[0]
