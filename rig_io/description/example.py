"""The logs that are to be described, and what a sidecar that is there already knows of such logs."""

from collections.abc import Collection, Mapping, Sequence
from itertools import takewhile
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
    logs: list[Path] = []
    for path in paths:
        if existing(path, "log", " Check the name and the folder.").is_dir():
            inside = log_files(path)
            if not inside:
                suffixes = ", ".join(sorted(_suffixes()))
                raise StickslipError(f"There is no log in '{path}'. Known are files ending in {suffixes}.")
            logs += inside
        else:
            logs.append(path)
    unique = list(dict.fromkeys(logs))
    if not unique:
        raise StickslipError("Name the logs that are to be described.")
    return unique


def log_files(folder: Path) -> list[Path]:
    """The files of a folder that are of a kind that is read, by their names."""
    suffixes = _suffixes()
    return [
        path
        for path in sorted(folder.iterdir())
        if path.suffix.lower() in suffixes and path.is_file() and not path.name.startswith(".")
    ]


def _suffixes() -> set[str]:
    ours = {suffix for name in READERS.members() for suffix in READERS.load(name).suffixes}
    return ours | {*packed.SUFFIXES}


def package_at(path: Path, required: bool) -> dict[str, Any]:
    beside = path if path.name == SIDECAR else path / SIDECAR
    if not beside.exists():
        if required:
            raise StickslipError(f"There is no {SIDECAR} in '{path}', after which a log could be described.")
        return {}
    return sidecar.load_json(beside)


def example_of(package: Mapping[str, Any], files: Sequence[Path], like: bool) -> dict[str, Any]:
    """What is known of such files: their own resource, or that of a like recorder, with what others know beside."""
    names = {path.name for path in files}
    resources = [dict(entry) for entry in package.get("resources", [])]
    same_files = [resource for resource in resources if names & set(files_of(resource))]
    same_kind = [
        resource
        for resource in resources
        if resource not in same_files and (like or Path(files_of(resource)[0]).suffix == files[0].suffix)
    ]
    # the one with most columns first: a free decay may be recorded without the drive
    ranked = [*same_files, *sorted(same_kind, key=lambda resource: -len(_fields(resource)))]
    if not ranked:
        return {}
    fields = {(field.get("file"), field["name"]): field for resource in reversed(ranked) for field in _fields(resource)}
    calibration = {
        name: entry for resource in reversed(ranked) for name, entry in resource.get("calibration", {}).items()
    }
    return {**ranked[0], "schema": {"fields": list(fields.values())}, "calibration": calibration}


def free_decay(folder: Path, package: Mapping[str, Any]) -> Path | None:
    """The first free decay of a package."""
    decays = [
        resource
        for resource in package.get("resources", [])
        if resource.get("experiment", {}).get("kind") == "free-decay"
    ]
    return folder / files_of(decays[0])[0] if decays else None


def kinds_alike(tables: Sequence[Collection[str]], resources: Sequence[Mapping[str, Any]]) -> set[str]:
    """Kinds of experiments that somebody confirmed of resources whose files have the columns of these tables."""
    names = {name for table in tables for name in table}
    alike = [one.get("experiment", {}) for one in resources if {field["name"] for field in _fields(one)} == names]
    return {one["kind"] for one in alike if "kind" in one and "kind" not in one.get("guessed", {})}


def _fields(resource: Mapping[str, Any]) -> list[dict[str, Any]]:
    entries = resource.get("schema", {}).get("fields", [])
    return [entry for entry in entries if isinstance(entry, dict) and "name" in entry]


def known_fields(example: Mapping[str, Any], path: Path) -> dict[str, dict[str, Any]]:
    """Described fields by name: of the file itself, or of the one in its place in a like recorder's files."""
    fields = _fields(example)
    of_files = [field for field in fields if "file" in field]
    if not of_files:
        return {str(field["name"]): field for field in fields}
    names = list(dict.fromkeys(field["file"] for field in of_files))
    nearest_name = path.name if path.name in names else max(names, key=lambda name: _ending(name, path.name))
    return {str(field["name"]): field for field in of_files if field["file"] == nearest_name}


def _ending(first: str, second: str) -> int:
    """Length of the common end of two names."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(first[::-1], second[::-1], strict=False)))
