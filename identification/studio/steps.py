"""Commands as they run in a study: what they say, which files they write, how they end.

Each has a folder of its own in `.studio`, so that a page that is opened again finds all of it.
"""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from identification.studio.forms import Values
from identification.studio.study import STUDY, add_step, begun, line

ROOM, OUT, ERR = ".studio", "out", "err"
WIDTH = "110"  # letters of a line of output
LAST = 20  # lines of progress that a page shows


@dataclass(frozen=True)
class Step:
    """number: from 1; arguments: of the command line; values: the form that it was given by; code: of its end, None
    while it runs; files: what it wrote, in the folder of the study; seconds: so far; room: where it is kept."""

    number: int
    arguments: tuple[str, ...]
    values: Values
    code: int | None
    files: tuple[str, ...]
    seconds: float
    room: Path

    @property
    def out(self) -> str:
        """What it said on standard output, read when it is asked for."""
        return (self.room / OUT).read_text("utf-8", "replace")

    @property
    def err(self) -> str:
        """The same of standard error."""
        return (self.room / ERR).read_text("utf-8", "replace")

    @property
    def line(self) -> str:
        """Its command line."""
        return line(self.arguments)

    @property
    def status(self) -> str:
        """How it stands, in a word."""
        names = {None: "running", 0: "done", 130: "stopped", -signal.SIGINT: "stopped"}
        return names.get(self.code, f"failed ({self.code})")

    @property
    def progress(self) -> str:
        """The end of what it says while it runs."""
        return "\n".join(self.err.splitlines()[-LAST:])


class Steps:
    """The commands that were given in a folder, and those that run."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._running: dict[int, Any] = {}
        self._lock = threading.Lock()

    def all(self) -> list[Step]:
        """Every step, the first one first."""
        return [step for number in self._numbers() if (step := self.step(number)) is not None]

    def _numbers(self) -> list[int]:
        return sorted(int(path.name) for path in (self.folder / ROOM).glob("*") if path.name.isdigit())

    def step(self, number: int) -> Step | None:
        """A step; None: there is none of this number."""
        room = self.folder / ROOM / str(number)
        if not (room / "given.json").is_file():
            return None
        begun_as = json.loads((room / "given.json").read_text("utf-8"))
        ended = json.loads((room / "ended.json").read_text("utf-8")) if (room / "ended.json").is_file() else {}
        # of a studio that was shut down meanwhile
        lost = not ended and number not in self._running
        return Step(
            number,
            tuple(begun_as["arguments"]),
            begun_as["values"],
            130 if lost else ended.get("code"),
            tuple(ended.get("files", ())),
            ended.get("seconds", time.time() - (room / "given.json").stat().st_mtime),
            room,
        )

    def begin(self, arguments: Sequence[str], values: Values) -> int:
        """Begin a command; its number."""
        with self._lock:
            number = 1 + max(self._numbers(), default=0)
            room = self.folder / ROOM / str(number)
            room.mkdir(parents=True)
            begun_as = {"arguments": list(arguments), "values": {name: list(value) for name, value in values.items()}}
            before = self._files()
            with (room / OUT).open("w") as out, (room / ERR).open("w") as err:
                environment = {**os.environ, "COLUMNS": WIDTH, "NO_COLOR": "1"}
                process = begun(arguments, self.folder, stdout=out, stderr=err, env=environment)
            self._running[number] = process
            (room / "given.json").write_text(json.dumps(begun_as), "utf-8")
        threading.Thread(target=self._wait, args=(number, process, before), daemon=True).start()
        return number

    def stop(self, number: int) -> None:
        """Interrupt a command, as Ctrl-C does: what is finished stays."""
        process = self._running.get(number)
        if process is not None and process.poll() is None:
            process.send_signal(signal.SIGINT if os.name == "posix" else signal.CTRL_C_EVENT)  # type: ignore[attr-defined]

    def close(self) -> None:
        """Interrupt all that runs, and wait for it."""
        for number, process in list(self._running.items()):
            self.stop(number)
            process.wait()

    def _wait(self, number: int, process: Any, before: dict[str, tuple[int, int]]) -> None:
        since = time.monotonic()
        code = process.wait()
        after = self._files()
        written = sorted(name for name, mark in after.items() if before.get(name) != mark)
        ended = {"code": code, "files": written, "seconds": time.monotonic() - since}
        with self._lock:
            step = self.step(number)
            if code == 0 and step is not None:
                add_step(self.folder / STUDY, step.arguments)
            (self.folder / ROOM / str(number) / "ended.json").write_text(json.dumps(ended), "utf-8")
            del self._running[number]

    def _files(self) -> dict[str, tuple[int, int]]:
        """Files of the study, and marks by which a change is known."""
        marks = {}
        for name in files_of(self.folder):
            stat = (self.folder / name).stat()
            marks[name] = stat.st_mtime_ns, stat.st_size
        return marks


def files_of(folder: Path) -> list[str]:
    """Files of a study by their paths in it; none that are hidden, no links, nor what stores are made of."""
    files = []
    for top, folders, names in os.walk(folder):
        stores = [name for name in folders if name.endswith(".zarr")]
        folders[:] = sorted(name for name in folders if not name.startswith(".") and name not in stores)
        place = Path(top).relative_to(folder)
        plain = (name for name in sorted(names) if not name.startswith(".") and not Path(top, name).is_symlink())
        files += [(place / name).as_posix() for name in plain]
    return files
