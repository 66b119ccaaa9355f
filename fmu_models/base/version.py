"""Version of this suite."""

from functools import cache


@cache
def version() -> str:
    """The version of the installed distribution."""
    from importlib import metadata  # takes as long as all else that a command imports before it begins

    try:
        return metadata.version("stickslip")
    except metadata.PackageNotFoundError:
        return "(from source)"
