"""A hunt finds what is wrong, says how to repeat it, and examines C by sanitizers. A long one: python tests/fuzz"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import fuzzing
import pytest
import sanitizers
from fuzzing import Finding, Target, generator, hunt
from mutations import mutated
from planted import FAULTS, NATIVE_FAULTS, RARE, SOUND
from targets import TARGETS

SECONDS = 300.0  # more than it takes anywhere


def findings(target: Target, cases: int = 6 * RARE) -> list[Finding]:
    hunted = hunt([replace(target, weight=1)], 3, SECONDS, rounds=cases, processes=1)
    return [one for one in hunted if isinstance(one, Finding)]


def test_nothing_is_found_where_nothing_is_wrong() -> None:
    assert findings(SOUND) == []


@pytest.mark.nightly_for("did not end within", "crashed (SIGABRT", "KeyError", "an error without words")
@pytest.mark.parametrize("what", FAULTS)
def test_a_fault_is_found_once(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fuzzing, "PATIENCE", 2.0)
    target = FAULTS[what]
    (found,) = findings(target)
    assert what in str(found)
    assert f"--target {target.name} --seed 3 --case {found.number}" in str(found)
    # the number alone repeats it
    assert fuzzing.tried(SOUND, 3, found.number) is None
    hunted = hunt([replace(target, weight=1)], 3, SECONDS, first=found.number, rounds=1)
    assert [one.place for one in hunted if isinstance(one, Finding)] == [found.place]


@pytest.mark.nightly_for("heap-buffer-overflow")
@pytest.mark.skipif(bool(sanitizers.missing()), reason=sanitizers.missing())
@pytest.mark.parametrize("what", NATIVE_FAULTS)
def test_a_fault_in_c_is_found_by_a_sanitizer(what: str) -> None:
    (found,) = findings(NATIVE_FAULTS[what], 2 * RARE)
    assert what in str(found)


@pytest.mark.parametrize("number", [131])  # rates that differ from call to call: steps without end
def test_lies_that_once_did_not_end(number: int) -> None:
    lies = TARGETS["lies"]
    outcomes = hunt([replace(lies, weight=1)], 20261123, SECONDS, first=number, rounds=1, processes=1)
    assert [str(one) for one in outcomes if isinstance(one, Finding)] == []


def test_cases_depend_on_the_seed_and_the_number_alone() -> None:
    text = "a = 1\nb = 'two'\nc = [3, 4]\n"
    assert mutated(text, generator("x", 1, 2)) == mutated(text, generator("x", 1, 2))
    assert len({mutated(text, generator("x", 1, number)) for number in range(100)}) > 50


@pytest.mark.nightly
def test_a_few_cases_of_every_parser() -> None:
    # a declaration is compiled, which takes longer than all documents together
    documents = (target for target in TARGETS.values() if not target.native and target.name != "declarations")
    parsers = [replace(target, weight=1) for target in documents]
    outcomes = list(hunt(parsers, 3, SECONDS, rounds=5, processes=1))
    assert [str(one) for one in outcomes if isinstance(one, Finding)] == []
    assert len(outcomes) == 5 * len(parsers)


@pytest.mark.nightly
def test_the_command_says_what_it_did() -> None:
    command = [sys.executable, str(Path(__file__).parent), "--minutes", "0.05", "--target", "units"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "cases: units " in done.stdout
    assert done.stdout.endswith("0 findings\n")
