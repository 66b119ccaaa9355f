"""Tables of a file that note what their reader asks for."""

from __future__ import annotations

from typing import Any


class Asked(dict[str, Any]):
    """A table that notes for which keys it was asked, with others of its level."""

    def __init__(self, entries: dict[str, Any], noted: set[str]) -> None:
        super().__init__(entries)
        self.noted = noted

    def get(self, key: str, default: Any = None) -> Any:
        self.noted.add(key)
        return super().get(key, default)

    def __getitem__(self, key: str) -> Any:
        self.noted.add(key)
        return super().__getitem__(key)
