"""Parameters of a test of which some run every day, and all at night."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def some_nightly(members: Iterable[Any], daily: Collection[Any]) -> list[Any]:
    """The members, those that are not among the daily ones marked as nightly."""
    return [m if m in daily else pytest.param(m, marks=pytest.mark.nightly) for m in members]
