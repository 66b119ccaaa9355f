"""The platforms FMUs are built for: on each of them for all, because the compiler brings every target along."""

import platform
import re
from collections.abc import Sequence
from typing import NamedTuple

from fmu_models.base.errors import StickslipError, nearest


class Platform(NamedTuple):
    """A platform: its folder in an FMU 3.0 and in an FMU 2.0, the compiler's target, the suffix of its libraries."""

    fmi3: str
    fmi2: str
    target: str
    suffix: str


# by the name a user gives; glibc is the oldest that the compiler offers, so that old systems load what is built here
PLATFORMS = {
    "linux64": Platform("x86_64-linux", "linux64", "x86_64-linux-gnu.2.17", ".so"),
    "linux-aarch64": Platform("aarch64-linux", "aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
    "win64": Platform("x86_64-windows", "win64", "x86_64-windows-gnu", ".dll"),
    "darwin-x86_64": Platform("x86_64-darwin", "darwin64", "x86_64-macos", ".dylib"),
    "darwin-aarch64": Platform("aarch64-darwin", "aarch64-darwin", "aarch64-macos", ".dylib"),
}
HOST, ALL = "host", "all"
_HOSTS = {
    ("linux", "x86_64"): "linux64",
    ("linux", "aarch64"): "linux-aarch64",
    ("windows", "x86_64"): "win64",
    ("darwin", "x86_64"): "darwin-x86_64",
    ("darwin", "aarch64"): "darwin-aarch64",
}


def this_platform() -> Platform:
    """The platform of the machine this runs on. StickslipError: FMUs cannot be built for this machine."""
    machine = platform.machine().lower()
    key = (platform.system().lower(), {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine))
    if key not in _HOSTS:
        listing = ", ".join("-".join(pair) for pair in _HOSTS)
        raise StickslipError(f"No FMU can be built on {'-'.join(key)}. Use one of: {listing}.")
    return PLATFORMS[_HOSTS[key]]


def platforms(names: Sequence[str]) -> tuple[Platform, ...]:
    """The platforms of names such as "win64", a folder's name of either version, "host" or "all"; each once.
    StickslipError: a name that is unknown, or none."""
    also = {folder: p for p in PLATFORMS.values() for folder in (p.fmi2, p.fmi3)} | PLATFORMS
    chosen: dict[Platform, None] = {}
    for name in names:
        if name == ALL:
            chosen |= dict.fromkeys(PLATFORMS.values())
        elif name == HOST:
            chosen[this_platform()] = None
        elif name in also:
            chosen[also[name]] = None
        elif re.fullmatch(r"win32|linux32|darwin32|x86-\w+|i[3-6]86-\w+", name):
            raise StickslipError(f"FMUs for '{name}', of 32 bits, are not built: results would differ. Choose win64.")
        else:
            choices = (*PLATFORMS, HOST, ALL)
            raise StickslipError(
                f"There is no platform '{name}'.{nearest(name, choices)} Choose: {', '.join(choices)}."
            )
    if not chosen:
        raise StickslipError(f"No platform is named. Choose: {', '.join((*PLATFORMS, HOST, ALL))}.")
    return tuple(chosen)
