"""The logs that are to be described, and what a sidecar that is there already knows of such logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import existing
from rig_io.logs import packed
from rig_io.packages import sidecar
from rig_io.packages.described import files_of
from rig_io.packages.sidecar import SIDECAR
from rig_io.readers import READERS


def log_paths(paths: Sequence[Path]) -> list[Path]:
    """The files named, and the logs in the folders named."""
    found: list[Path] = []
    for path in paths:
        if existing(path, "log", " Check the name and the folder.").is_dir():
            inside = log_files(path)
            if not inside:
                known = ", ".join(sorted(_suffixes()))
                raise StickslipError(f"There is no log in '{path}'. Known are files ending in {known}.")
            found += inside
        else:
            found.append(path)
    unique = list(dict.fromkeys(found))
    if not unique:
        raise StickslipError("Name the logs that are to be described.")
    return unique


def log_files(folder: Path) -> list[Path]:
    """The files of a folder that are of a kind that is read, by their names."""
    suffixes = _suffixes()
    return [
        one
        for one in sorted(folder.iterdir())
        if one.suffix.lower() in suffixes and one.is_file() and not one.name.startswith(".")
    ]


def _suffixes() -> set[str]:
    ours = {suffix for name in READERS.members() for suffix in READERS.load(name).suffixes}
    return ours | {*packed.SUFFIXES}


def package_at(place: Path, required: bool) -> dict[str, Any]:
    beside = place if place.name == SIDECAR else place / SIDECAR
    if not beside.exists():
        if required:
            raise StickslipError(f"There is no {SIDECAR} in '{place}', after which a log could be described.")
        return {}
    return sidecar.load_json(beside)


def example_of(known: Mapping[str, Any], files: Sequence[Path], like: bool) -> dict[str, Any]:
    """What is known of such files: their own resource, or that of a like recorder, with what others know beside."""
    names = {path.name for path in files}
    resources = [dict(one) for one in known.get("resources", [])]
    own = [one for one in resources if names & set(files_of(one))]
    alike = [one for one in resources if one not in own and (like or _same_kind(one, files))]
    # the one with most columns first: a free decay may be recorded without the drive
    ranked = [*own, *sorted(alike, key=lambda one: -len(_fields(one)))]
    if not ranked:
        return {}
    fields = {(one.get("file"), one["name"]): one for resource in reversed(ranked) for one in _fields(resource)}
    calibration = {name: one for resource in reversed(ranked) for name, one in resource.get("calibration", {}).items()}
    return {**ranked[0], "schema": {"fields": list(fields.values())}, "calibration": calibration}


def free_decay(folder: Path, package: Mapping[str, Any]) -> Path | None:
    """The first free decay of a package."""
    decays = [one for one in package.get("resources", []) if one.get("experiment", {}).get("kind") == "free-decay"]
    return folder / files_of(decays[0])[0] if decays else None


def _fields(resource: Mapping[str, Any]) -> list[dict[str, Any]]:
    found = resource.get("schema", {}).get("fields", [])
    return [one for one in found if isinstance(one, dict) and "name" in one]


def _same_kind(resource: Mapping[str, Any], files: Sequence[Path]) -> bool:
    return Path(files_of(resource)[0]).suffix == files[0].suffix


def known_fields(example: Mapping[str, Any], path: Path) -> dict[str, dict[str, Any]]:
    """Described fields by name: of the file itself, or of the one in its place in a like recorder's files."""
    fields = _fields(example)
    of_files = [one for one in fields if "file" in one]
    if not of_files:
        return {str(one["name"]): one for one in fields}
    names = list(dict.fromkeys(one["file"] for one in of_files))
    own = path.name if path.name in names else max(names, key=lambda name: _ending(name, path.name))
    return {str(one["name"]): one for one in of_files if one["file"] == own}


def _ending(one: str, other: str) -> int:
    """Length of the common end of two names."""
    length = 0
    while length < min(len(one), len(other)) and one[-1 - length] == other[-1 - length]:
        length += 1
    return length
