"""Units as they are written: pint reads them, once per process and without SymPy."""

from __future__ import annotations

import re
from functools import cache
from typing import Any


def parse_unit(unit: str) -> Any:
    """A unit such as "N m/rad" as a pint quantity."""
    written = re.sub(r"([A-Za-z]+)(\d+)", r"\1**\2", unit).replace("/", " / ")
    return _registry().Quantity(1.0, re.sub(r"(?<=[\w)]) +(?=[\w(])", "*", written))


@cache
def known_units() -> tuple[str, ...]:
    """Names and symbols of all units, without prefixes."""
    return tuple(sorted(name for name in dir(_registry()) if not name.startswith("_")))


@cache
def _registry() -> Any:
    """One pint registry per process: it takes long to make."""
    import pint

    return pint.UnitRegistry()
