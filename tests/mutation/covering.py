"""Which tests cover a line, fastest first: measured file by file when they are asked for, and kept.

Files of tests are tried in the order of what they name: a function that few files of tests name counts for much. A map
of one file of tests holds its times and, for each module, the lines that each test runs; it serves as long as that file
and that module stay as they are. C is not measured: files of tests that are called like it, that load what is built
from it (``PROBES``) or that noticed its other mutants are run whole.
"""

from __future__ import annotations

import ast
import json
import re
import shutil
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path

from mutation import trial

# files of tests that load what is built from a folder of C, quick ones first
PROBES = {
    "fmu_models/engine/ensemble": ("test_ensemble", "test_sections", "test_impacts", "test_crossings", "test_lanes"),
    "fmu_models/engine/events": (
        *(
            "test_complementarity",
            "test_bouncing_ball",
            "test_impacts_extremes",
            "test_block_on_belt",
            "test_accumulation",
        ),
        *(
            "test_impact_enumeration",
            "test_many_contacts",
            "test_rigid_mechanisms",
            "test_woodpecker",
            "test_energy_watch",
        ),
        *("test_random_cross_check", "test_collisions", "test_dry_friction"),
    ),
    "fmu_models/engine/fmi": (
        *("test_fmu_states", "test_illegal_calls", "test_random_calls", "test_inputs_and_starts", "test_clocks"),
        *("test_directional_derivatives", "test_output_derivatives", "test_map_fmus", "test_master_on_ours"),
    ),
    "fmu_models/engine/model": ("test_jets", "test_falls", "test_fmu_states", "test_simulation", "test_lowering"),
    "fmu_models/engine/step": (
        *(
            "test_falls",
            "test_bouncing_ball",
            "test_block_on_belt",
            "test_sections",
            "test_pendulums",
            "test_simulation",
        ),
        *("test_force_at_the_limit", "test_rigid_mechanisms", "test_many_contacts", "test_random_cross_check"),
    ),
    "fmu_models/engine/tangents": (
        *("test_sensitivities", "test_sensitivities_differences", "test_sensitivities_extremes"),
        *("test_sensitive_run", "test_directional_derivatives"),
        *("test_variations", "test_multipliers", "test_derivatives", "test_output_derivatives"),
    ),
    "fmu_models/engine/whole_run": (
        *("test_simulation", "test_ensemble"),
        *("test_sensitive_run", "test_sensitivities_differences"),
    ),
    "fmu_models/explorer/c": ("test_explore_engine", "test_explorer"),
    "fmu_models/importer/c": (
        *(
            "test_driver",
            "test_events",
            "test_sliding_of_any_fmu",
            "test_sections_of_any_fmu",
            "test_clocks_of_any_fmu",
        ),
        *("test_methods_on_any_fmu", "test_texts_of_any_fmu", "test_arrays", "test_coupling", "test_cosimulation"),
        *("test_branches_of_any_fmu", "test_master_on_ours", "test_exact_flow", "test_sparse_jacobians"),
    ),
    "fmu_models/lanes/c": ("test_lanes", "test_lane_tangents", "test_lane_limits", "test_ensemble"),
}
# tests that say nothing of what a program computes, or take a browser, a build of the manual, a wheel
LEFT_OUT = re.compile(
    r"test_(?:wheel|manual_site|explorer_firefox|explorer_page|first_steps|fuzz|mutants|c?_?architecture|c_architecture|checkers|live_report)\.py$"
)
_WORD = re.compile(r"[A-Za-z_]\w{2,}")
MEASURING = 120.0  # s of CPU time for the map of one file


@dataclass(frozen=True)
class Choice:
    """Tests of one file. order: by their times, those that cover the line first. seconds: all of them together."""

    file: str
    order: dict[str, float]
    seconds: float


class Suite:
    """The files of tests in a tree, and what is known of them."""

    def __init__(self, tree: Path, environment: dict[str, str]) -> None:
        self.tree, self.environment = tree, environment
        self.maps: dict[str, dict] = {}
        self.passing: dict[str, bool] = {}
        paths = sorted((tree / "tests").rglob("test_*.py"))
        self.files = [path.relative_to(tree).as_posix() for path in paths if not LEFT_OUT.search(path.name)]

    @cached_property
    def _words(self) -> dict[str, set[str]]:
        """Words of each file of tests and of the helpers beside it."""
        helpers = {path.stem: path for path in (self.tree / "tests").rglob("*.py") if not path.name.startswith("test_")}
        words = {}
        for file in self.files:
            text = (self.tree / file).read_text("utf-8")
            parts = {file: text}
            waiting = [text]
            while waiting:
                for name in (
                    set(re.findall(r"^(?:from|import) (\w+)", waiting.pop(), re.M)) & helpers.keys() - parts.keys()
                ):
                    parts[name] = helpers[name].read_text("utf-8")
                    waiting.append(parts[name])
            words[file] = set(_WORD.findall(" ".join(parts.values()))) | set(Path(file).stem.split("_"))
        return words

    @cached_property
    def _frequency(self) -> Counter[str]:
        return Counter(word for words in self._words.values() for word in words)

    def ranked(self, file: str, text: str, room: str, noticed: Counter[str]) -> list[str]:
        """Files of tests by what they name of a source file; first those that noticed its mutants before."""
        parts = {part for part in Path(file).stem.split("_") if len(part) > 2}
        if is_native(file):
            probes = PROBES.get(room, ())
            scores = {t: 1.0 / (1 + probes.index(Path(t).stem)) for t in self.files if Path(t).stem in probes}
            for test in self.files:
                if parts & set(Path(test).stem.split("_")):
                    scores[test] = scores.get(test, 0.0) + 0.1
        else:
            names = _defined(text) | {Path(file).stem}
            module, called = ".".join(Path(file).with_suffix("").parts), f"test_{Path(file).stem}"
            scores = {test: sum(1.0 / self._frequency[n] for n in names & self._words[test]) for test in self.files}
            for test in self.files:
                words = (self.tree / test).read_text("utf-8")
                scores[test] += (module in words) + 0.1 * (room.replace("/", ".") in words)
                scores[test] += 0.3 * len((parts | {Path(room).name}) & set(Path(test).stem.split("_")))
                scores[test] += 3.0 * Path(test).stem.startswith(called)
                scores[test] += Path(test).parent.as_posix().endswith("/" + room.removeprefix("fmu_models/"))
                scores[test] *= 0.3 if "end_to_end" in test else 1.0  # whole commands take longest
        for test, count in noticed.items():
            scores[test] = scores.get(test, 0.0) + 3.0 * min(count, 3)
        return sorted((test for test in self.files if scores.get(test, 0.0) > 0.0), key=lambda test: -scores[test])

    def building(self, test: str) -> Choice | None:
        """All tests of a file that passes without a mutant, by their times; None if there are none."""
        known = self.map_of(test) if self.is_known(test) else self._kept_times(test)
        seconds = known["seconds"]
        return Choice(test, dict(seconds), sum(seconds.values())) if seconds else None

    def covering(self, test: str, file: str, line: int) -> Choice | None:
        """Tests of a file that run a line, and those that share fixtures with them; None if none of them does."""
        known = self.map_of(test, file)
        lines = known["modules"].get(file, {}).get("lines", {})
        if not lines:
            return None
        seconds = known["seconds"]
        if line in _at_import(self.tree / file):
            touching = {test for tests in lines.values() for test in tests}
        else:
            touching = set(lines.get(str(line), ()))
            if not touching:
                return None
        if "" in touching:
            touching |= seconds.keys()
        order = {name: (0.0 if name in touching else 1e6) + took for name, took in seconds.items()}
        return Choice(test, order, sum(seconds.values())) if order else None

    def map_of(self, test: str, file: str = "") -> dict:
        """The map of a file of tests, made where there is none that holds for a module."""
        if test not in self.maps:
            path = self._kept(test)
            self.maps[test] = json.loads(path.read_text("utf-8")) if path.is_file() else {}
        known = self.maps[test]
        module = known.get("modules", {}).get(file)
        stale = module is not None and module["hash"] != _hash(self.tree / file)
        if not known or known["test"] != _hash(self.tree / test) or stale:
            known = self._measure(test)
            self.maps[test] = known
            self._kept(test).parent.mkdir(parents=True, exist_ok=True)
            self._kept(test).write_text(json.dumps(known), "utf-8")
        return known

    def is_known(self, test: str) -> bool:
        """Whether a map is there, which need not be the newest."""
        return test in self.maps or self._kept(test).is_file()

    def passes(self, test: str) -> bool:
        """Whether a test passes where nothing is altered; asked once in a run."""
        if test not in self.passing:
            outcome = trial.run(self.tree, [test.split("::")[0]], {test: 0.0}, self.environment, MEASURING)
            self.passing[test] = not outcome.failed and test in outcome.seconds
        return self.passing[test]

    def _kept_times(self, test: str) -> dict:
        path = self._kept(test).with_suffix(".times")
        known = json.loads(path.read_text("utf-8")) if path.is_file() else {}
        if known.get("test") != _hash(self.tree / test):
            outcome = trial.run(self.tree, [test], {}, self.environment, MEASURING, first=False)
            known = {"test": _hash(self.tree / test), "seconds": outcome.seconds}
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(known), "utf-8")
        return known

    def _kept(self, test: str) -> Path:
        return self.tree.parent / "maps" / (Path(test).stem + ".json")

    def _measure(self, test: str) -> dict:
        import coverage

        folder = self.tree.parent / "coverage"
        shutil.rmtree(folder, ignore_errors=True)
        outcome = trial.run(self.tree, [test], {}, self.environment, MEASURING, first=False, covered=folder)
        data = coverage.CoverageData(str(folder / "all"))
        for part in sorted(folder.glob("data.*")):
            piece = coverage.CoverageData(str(part))
            try:
                piece.read()
                data.update(piece)
            except coverage.CoverageException:  # a child that was ended while it wrote
                continue
        modules = {}
        for path in sorted(data.measured_files()):
            if Path(path).is_file():
                contexts = data.contexts_by_lineno(path)
                lines = {str(n): sorted({c.split("|")[-1] for c in names}) for n, names in contexts.items()}
                file = Path(path).relative_to(self.tree).as_posix()
                modules[file] = {"hash": _hash(Path(path)), "lines": lines}
        return {
            "test": _hash(self.tree / test),
            "seconds": outcome.seconds,
            "failures": list(outcome.failures) + ([outcome.failed] if outcome.timed_out else []),
            "modules": modules,
        }


def _hash(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()[:16] if path.is_file() else ""


def is_native(file: str) -> bool:
    """Whether a source file is C."""
    return file.endswith((".c", ".h"))


def _defined(text: str) -> set[str]:
    """Functions and classes that a module shows to others."""
    top = [node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    return {node.name for node in top if not node.name.startswith("_")}


def _at_import(path: Path) -> set[int]:
    """Lines that run when a module is loaded."""
    tree = ast.parse(path.read_text("utf-8"))
    inside = set()
    for node in _functions(tree):
        body = node.body if isinstance(node.body, list) else [node.body]
        inside |= set(range(body[0].lineno, (body[-1].end_lineno or 0) + 1))
    return set(range(1, len(path.read_text("utf-8").splitlines()) + 1)) - inside


def _functions(tree: ast.AST) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node
