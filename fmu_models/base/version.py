"""Version of this suite."""

from __future__ import annotations

from importlib import metadata


def version() -> str:
    """As the installed distribution says it."""
    try:
        return metadata.version("stickslip")
    except metadata.PackageNotFoundError:
        return "(from source)"
