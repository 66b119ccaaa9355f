"""What a watch knows: each log that it has dealt with, and what came of it. Kept in a file, so that it can go on."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from fmu_models.base.errors import StickslipError
from fmu_models.base.files import write_whole
from fmu_models.base.plain_values import from_plain
from fmu_models.base.trust import admit

VERSION = 1
FITTED, DECAY, REFUSED = "fitted", "free-decay", "refused"


@dataclass(frozen=True)
class Entry:
    """One log. files: size in bytes and time of change in ns of each; checksum: of all; recorded: s since 1970, when
    the last file was changed; status: `FITTED`, `DECAY` or `REFUSED`, with its reason; values: name -> (value, standard
    deviation); silent: columns that show nothing; calls: what the control charts say, in words."""

    name: str
    files: Mapping[str, tuple[int, int]]
    checksum: str
    recorded: float
    status: str
    reason: str = ""
    values: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    silent: tuple[str, ...] = ()
    calls: tuple[str, ...] = ()


@dataclass(frozen=True)
class WatchState:
    """law, estimator: by which logs are fitted; entries: in the order in which they were dealt with."""

    law: str
    estimator: str
    entries: tuple[Entry, ...] = ()

    def knows(self, files: Mapping[str, tuple[int, int]]) -> bool:
        """Whether files as they are now have been dealt with."""
        return any(dict(entry.files) == dict(files) for entry in self.entries)

    def twin(self, checksum: str) -> Entry | None:
        """The entry of a log of the same content, under whatever name."""
        return next((entry for entry in self.entries if entry.checksum == checksum and entry.status != REFUSED), None)

    def with_entry(self, entry: Entry) -> WatchState:
        """The state with one more entry, which takes the place of an older one of the same name."""
        return replace(self, entries=(*(old for old in self.entries if old.name != entry.name), entry))

    def fitted(self) -> list[Entry]:
        """The entries that hold values, by time."""
        return sorted((entry for entry in self.entries if entry.status == FITTED), key=lambda entry: entry.recorded)

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {"type": "stickslip watch", "version": VERSION, **asdict(self)}


def write_state(path: Path, state: WatchState) -> None:
    """Write the state, whole or not at all."""
    with write_whole(path, overwrite=True) as temporary:
        temporary.write_text(json.dumps(state.to_dict(), indent=1, allow_nan=False) + "\n", encoding="utf-8")


def read_state(path: Path, *, trust: bool = False) -> WatchState:
    """A state as `write_state` wrote it; trust: Python files that it names, of a law or an estimator, may run.
    StickslipError: the file is none, or names code that is not trusted."""
    try:
        plain = json.loads(path.read_text(encoding="utf-8"))
        if plain["type"] != "stickslip watch" or plain["version"] != VERSION:
            raise KeyError("version")
        state = from_plain(
            WatchState, {key: value for key, value in plain.items() if key not in ("type", "version")}, "it"
        )
    except (OSError, ValueError, KeyError, TypeError, StickslipError) as error:
        raise StickslipError(
            f"'{path}' is not the state of a watch ({type(error).__name__}: {error}). Remove it to begin anew, or name "
            "another one: --state FILE."
        ) from error
    try:
        for reference in (state.law, state.estimator):
            admit(reference, Path(), trust=trust)
    except StickslipError as error:
        raise StickslipError(f"'{path}': {error}") from None
    return state
