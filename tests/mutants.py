"""The power of the tests: alter one line at a time and see which tests notice.

    python tests/mutants.py --count 400 --minutes 60            # over all rooms
    python tests/mutants.py --room rig_io/sensors --count 20    # one of them; what was judged before is not run again

Each mutant is judged in a copy of the tree by the tests that cover its line, fastest first, up to the first that
fails. One that ends in a time-out is killed; one that does not compile is drawn again. A mutant that no test can notice
is noted with the reason in tests/mutation/equivalent.toml. The exit code is 1 if any other survives.
"""

from __future__ import annotations

import argparse
import fcntl
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter, defaultdict
from collections.abc import Container, Iterator
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from zlib import crc32

sys.path[:] = [str(Path(__file__).parent), *sys.path[1:]]

from mutation import trial  # noqa: E402
from mutation.alterations import Mutant, is_compiled, mutants  # noqa: E402
from mutation.covering import Choice, Suite, is_native  # noqa: E402

ROOT = Path(__file__).parents[1]
# C without optimization has the same bits and takes the compiler a seventh of the time
COMPILER, QUICK = "fmu_models/toolchain/compiler.py", (b'"-O2"', b'"-O0"')
PACKAGES = ("fmu_models", "rig_io", "identification")
EQUIVALENT = Path(__file__).parent / "mutation" / "equivalent.toml"
GOAL = 0.9  # share of mutants that are killed in each room
SLOW = 10.0  # a trial may take so many times what its tests take without a mutant, and
START = 40.0  # s of CPU time besides
# so many files of tests are run before any is measured, which takes longer than to run it: most mutants end there
NEAREST = 2
USUAL = 12.0  # s that a file of tests takes of which nothing is known


@dataclass(frozen=True)
class Verdict:
    """What became of a mutant.

    Attributes:
        name: of the mutant, which survives changes of other lines.
        source: hash of the file as it was.
        room: folder of the file.
        line: its number then.
        verdict: "killed", "survived", "equivalent" or "uncompiled".
        by: the first test that noticed it.
        tried: files of tests that did not.
        reason: of an equivalent one.
    """

    name: tuple[str, str, int, str]
    source: str
    room: str
    line: int
    verdict: str
    by: str = ""
    tried: tuple[str, ...] = ()
    reason: str = ""


def main() -> int:
    """The exit code."""
    parser = argparse.ArgumentParser(
        prog="python tests/mutants.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=40, help="mutants of all rooms together (default: 40)")
    parser.add_argument("--seed", type=int, default=0, help="what they are drawn from (default: 0)")
    parser.add_argument("--room", action="append", help="folder such as rig_io/sensors; repeat for several")
    parser.add_argument("--file", help="only mutants of this source file")
    parser.add_argument("--line", type=int, help="with --file: only mutants of this line, all of them")
    parser.add_argument("--minutes", type=float, default=60.0, help="no mutant is begun later (default: 60)")
    parser.add_argument(
        "--patience",
        type=float,
        default=90.0,
        help="s of tests, and of measuring what they cover, for each mutant (default: 90)",
    )
    parser.add_argument("--tests", action="append", default=[], help="a file of tests to be tried first; several too")
    parser.add_argument("--again", action="store_true", help="judge survivors of earlier runs again")
    parser.add_argument("--folder", type=Path, help="of the copy, of maps and of results (default: one of this user)")
    parser.add_argument("--json", action="store_true", help="rooms and survivors as JSON")
    asked = parser.parse_args()
    folder = asked.folder or Path(tempfile.gettempdir()) / f"stickslip_mutants_{os.getuid()}"
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:  # until the end
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            parser.error(f"'{folder}' is in use by another run. Wait for it, or choose another --folder.")
        return _run(parser, asked, folder)


def _run(parser: argparse.ArgumentParser, asked: argparse.Namespace, folder: Path) -> int:
    """The exit code of a run in a folder of its own."""
    tree = copied(folder)
    rooms = rooms_of(tree)
    if unknown := set(asked.room or ()) - rooms.keys():
        parser.error(f"no room '{unknown.pop()}'; there are {', '.join(rooms)}")
    if asked.file:
        rooms = {room: files for room, names in rooms.items() if (files := [n for n in names if n == asked.file])}
    rooms = {room: files for room, files in rooms.items() if room in (asked.room or rooms)}
    judge = Judge(tree, folder, asked.patience, asked.again, tuple(asked.tests))
    waiting = {room: drawn(tree, files, asked.seed, judge.verdicts) for room, files in rooms.items()}
    if asked.file and asked.line:
        text = (tree / asked.file).read_text("utf-8")
        waiting = {room: [m for m in mutants(asked.file, text) if m.line == asked.line] for room in rooms}
    verdicts = list(judged(judge, waiting, asked.count, time.monotonic() + 60.0 * asked.minutes, asked.json))
    report(verdicts, asked.json)
    return 1 if any(verdict.verdict == "survived" for verdict in verdicts) else 0


def copied(folder: Path) -> Path:
    """A copy of this checkout: what git knows of, and new files that it does not ignore."""
    tree = folder / "tree"
    names = subprocess.run(
        ["git", "ls-files", "-coz", "--exclude-standard"], cwd=ROOT, capture_output=True, check=True
    ).stdout.decode()
    wanted = {name for name in names.split("\0") if name and (ROOT / name).is_file()}
    if tree.is_dir():
        for path in [path for path in tree.rglob("*") if path.is_file() and "__pycache__" not in path.parts]:
            if path.relative_to(tree).as_posix() not in wanted:
                path.unlink()
    for name in sorted(wanted):
        target, content = tree / name, (ROOT / name).read_bytes()
        if name == COMPILER:
            content = content.replace(*QUICK)
        if not target.is_file() or target.read_bytes() != content:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
    return tree


def rooms_of(tree: Path) -> dict[str, list[str]]:
    """Source files by room: the first two names of a Python file, the folder of one in C."""
    rooms = defaultdict(list)
    for package in PACKAGES:
        for path in sorted((tree / package).rglob("*")):
            file = path.relative_to(tree)
            if path.suffix in (".c", ".h"):
                rooms[file.parent.as_posix()].append(file.as_posix())
            elif path.suffix == ".py" and len(file.parts) > 2:
                rooms["/".join(file.parts[:2])].append(file.as_posix())
    return dict(sorted(rooms.items()))


def drawn(tree: Path, files: list[str], seed: int, judged_before: Container[tuple[str, str, int, str]]) -> list[Mutant]:
    """Mutants of a room in the order in which they are judged, one a line: those of earlier runs, then by lot.

    A lot depends on the mutant alone, so that other lines may change between runs.
    """

    def order(mutant: Mutant) -> tuple[bool, bytes]:
        return mutant.name not in judged_before, sha256(repr((seed, mutant.name)).encode()).digest()

    lines: dict[tuple[str, int], Mutant] = {}
    for file in files:
        for mutant in sorted(mutants(file, (tree / file).read_text("utf-8")), key=order):
            lines.setdefault((file, mutant.line), mutant)
    return sorted(lines.values(), key=order)


def judged(judge: Judge, order: dict[str, list[Mutant]], count: int, end: float, quiet: bool) -> Iterator[Verdict]:
    """Verdicts in turn over the rooms, so that a run that is broken off has seen all of them."""
    waiting = {room: iter(drawn_mutants) for room, drawn_mutants in order.items()}
    done = 0
    while waiting and done < count:
        for room in list(waiting):
            verdict = None
            while verdict is None or verdict.verdict == "uncompiled":
                mutant = next(waiting[room], None)
                if mutant is None:
                    del waiting[room]
                    break
                verdict = judge.remembered(mutant)
                if verdict is None:
                    if time.monotonic() > end:
                        return
                    verdict = judge(mutant, room)
                    if not quiet:
                        print(f"{verdict.verdict:10} {mutant.file}:{mutant.line}  {verdict.by}", flush=True)
            else:
                yield verdict
                done += 1
            if done == count:
                return


class Judge:
    """Judges mutants in a copy of the tree and keeps what it found."""

    def __init__(self, tree: Path, folder: Path, patience: float, again: bool, first: tuple[str, ...] = ()) -> None:
        self.folder, self.patience, self.again, self.first = folder, patience, again, first
        for name in ("cache", "zig"):
            (folder / name).mkdir(parents=True, exist_ok=True)
        environment = {"STICKSLIP_CACHE": str(folder / "cache"), "ZIG_GLOBAL_CACHE_DIR": str(folder / "zig")}
        self.suite = Suite(tree, environment)
        self.results = folder / "results.jsonl"
        lines = self.results.read_text("utf-8").splitlines() if self.results.is_file() else []
        self.verdicts: dict[tuple, Verdict] = {}
        self.noticed: dict[str, Counter[str]] = defaultdict(Counter)
        for line in lines:
            values = json.loads(line)
            self._remember(Verdict(**values | {"name": tuple(values["name"]), "tried": tuple(values["tried"])}))
        notes = tomllib.loads(EQUIVALENT.read_text("utf-8")) if EQUIVALENT.is_file() else {}
        self.equivalent = {(n["file"], n["stands"], n["mutant"]): n["reason"] for n in notes.get("equivalent", ())}

    def remembered(self, mutant: Mutant) -> Verdict | None:
        """The verdict of an earlier run, if the file is as it was."""
        verdict = self.verdicts.get(mutant.name)
        file, stands, _, altered = mutant.name
        if reason := self.equivalent.get((file, stands, altered)):
            return Verdict(mutant.name, "", _room(file), mutant.line, "equivalent", reason=reason)
        if verdict is None or (verdict.verdict == "survived" and self.again):
            return None
        return verdict if verdict.source == self._source(file) or verdict.verdict == "killed" else None

    def __call__(self, mutant: Mutant, room: str) -> Verdict:
        """Judge a mutant by the tests that cover it."""
        text = (self.suite.tree / mutant.file).read_text("utf-8")
        verdict, by, tried = "survived", "", ()
        if not is_native(mutant.file) and not is_compiled(mutant, text):
            verdict = "uncompiled"
        else:
            verdict, by, tried = self._tried(mutant, text, room)
        result = Verdict(mutant.name, self._source(mutant.file), room, mutant.line, verdict, by, tuple(tried))
        with self.results.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(result)) + "\n")
        self._remember(result)
        return result

    def _remember(self, verdict: Verdict) -> None:
        self.verdicts[verdict.name] = verdict
        if verdict.verdict == "killed" and "::" in verdict.by:
            self.noticed[verdict.name[0]][verdict.by.split("::")[0]] += 1

    def _source(self, file: str) -> str:
        return sha256((self.suite.tree / file).read_bytes()).hexdigest()[:16]

    def _tried(self, mutant: Mutant, text: str, room: str) -> tuple[str, str, list[str]]:
        """Verdict, the test that noticed it, and the files of tests that did not."""
        spent, tried = 0.0, []
        native = is_native(mutant.file)
        ranked = self.suite.ranked(mutant.file, text, room, self.noticed[mutant.file])
        for test in dict.fromkeys((*self.first, *ranked)):
            if spent > self.patience:
                break
            begin = _cpu_time()
            if native:
                choice = self.suite.building(test)
            elif len(tried) < NEAREST and not self.suite.is_known(test):
                choice = Choice(test, {}, USUAL)
            else:
                choice = self.suite.covering(test, mutant.file, mutant.line)
            if choice is None:
                spent += _cpu_time() - begin
                continue
            outcome = self._altered(mutant, text, test, choice.order, START + SLOW * choice.seconds)
            if outcome.failed == trial.DIED:  # which a busy machine can do too
                outcome = self._altered(mutant, text, test, choice.order, START + SLOW * choice.seconds)
            if native and trial.UNCOMPILED in outcome.why:
                return "uncompiled", "", tried
            if outcome.failed and (outcome.timed_out or "::" not in outcome.failed or self._passes(outcome.failed)):
                return "killed", outcome.failed, tried
            tried.append(test)
            spent += _cpu_time() - begin
        return "survived", "", tried

    def _passes(self, test: str) -> bool:
        """Whether a test that fails with a mutant passes without."""
        known = self.suite.maps.get(test.split("::")[0]) or {}
        return test in known.get("seconds", ()) or self.suite.passes(test)

    def _altered(self, mutant: Mutant, text: str, test: str, order: dict[str, float], patience: float) -> trial.Outcome:
        """What tests do while the file is altered, with a copy of the cache that is thrown away."""
        path = self.suite.tree / mutant.file
        cache = self.folder / "altered"
        shutil.rmtree(cache, ignore_errors=True)
        shutil.copytree(self.folder / "cache", cache, copy_function=os.link)
        shutil.rmtree(cache / "units", ignore_errors=True)
        environment = self.suite.environment | {"STICKSLIP_CACHE": str(cache)}
        try:
            # the compiled file of Python is told by size and whole seconds, which a mutant may share
            path.write_text(mutant.applied(text), "utf-8")
            os.utime(path, (0, 1_000_000_000 + crc32(repr(mutant.name).encode()) // 8))
            return trial.run(self.suite.tree, [test], order, environment, patience)
        finally:
            path.write_text(text, "utf-8")
            os.utime(path, (0, 900_000_000))


def _cpu_time() -> float:
    """Of this process and of the children that ended, s."""
    return sum(os.times()[:4])


def _room(file: str) -> str:
    path = Path(file)
    return path.parent.as_posix() if is_native(file) else "/".join(path.parts[:2])


def report(verdicts: list[Verdict], as_json: bool) -> None:
    """Rooms with what was killed in each, and the survivors."""
    rooms: dict[str, Counter[str]] = defaultdict(Counter)
    for verdict in verdicts:
        rooms[verdict.room][verdict.verdict] += 1
    survivors = [verdict for verdict in verdicts if verdict.verdict == "survived"]
    if as_json:
        print(json.dumps({"rooms": rooms, "survivors": [asdict(verdict) for verdict in survivors]}, indent=1))
        return
    print()
    for room, counts in sorted(rooms.items()):
        judged = counts["killed"] + counts["survived"]
        mark = " " if counts["killed"] >= GOAL * judged else "<"
        print(f"{mark} {room:32} {counts['killed']:4} of {judged:4} killed, {counts['equivalent']} equivalent")
    killed = sum(counts["killed"] for counts in rooms.values())
    print(f"  {'all':32} {killed:4} of {killed + len(survivors):4} killed")
    for verdict in sorted(survivors, key=lambda v: (v.room, v.name)):
        file, stands, _, altered = verdict.name
        tried = ", ".join(verdict.tried) or "any test"
        print(f"\n{file}:{verdict.line}\n- {stands}\n+ {altered}\n  not noticed by {tried}")


if __name__ == "__main__":
    sys.exit(main())
