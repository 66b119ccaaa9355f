"""Versions of this suite and of what it uses."""

import sys
from functools import cache
from pathlib import Path


def version() -> str:
    """The version of this suite."""
    return version_of("stickslip") or "(from source)"


@cache
def version_of(package: str) -> str:
    """The version of an installed distribution; empty if it is not installed."""
    for folder in map(Path, sys.path):
        for found in folder.glob(f"{package}-*.dist-info"):
            return found.stem.partition("-")[2]
    from importlib import metadata  # takes as long as all else that a command imports before it begins

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""
