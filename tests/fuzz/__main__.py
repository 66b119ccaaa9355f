"""Hunt for what crashes, hangs or is told badly: python tests/fuzz --minutes 60 --seed 7

Functions of generated models, FMUs that lie to the importer, declarations that nobody wrote (against tests/oracle), and
every parser on documents that are nearly right. C
runs under AddressSanitizer and UndefinedBehaviorSanitizer where gcc or clang of the system have them. Each finding
comes with the line that repeats its case; the exit code is 1 if there is any.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter, defaultdict
from dataclasses import replace
from pathlib import Path

# pytest does the same for the tests beside
sys.path[:0] = [str(Path(__file__).parents[1] / name) for name in (".", "fuzz", "conformance", "foreign", "helpers")]
sys.path.insert(0, str(Path(__file__).parents[2]))

import sanitizers  # noqa: E402
from fuzzing import Finding, Target, hunt  # noqa: E402
from targets import TARGETS  # noqa: E402

EVERY = 30.0  # s between lines of progress


def main() -> int:
    """The exit code."""
    parser = argparse.ArgumentParser(prog="python tests/fuzz", description=str(__doc__).split("\n\n")[0])
    parser.add_argument("--minutes", type=float, default=2.0, help="for all targets together (default: 2)")
    parser.add_argument("--seed", type=int, default=0, help="what cases are drawn from (default: 0)")
    parser.add_argument(
        "--target", choices=sorted(TARGETS), action="append", help="repeat for several (default: all but declarations)"
    )
    parser.add_argument("--cases", type=int, help="so many of each target, if time allows (default: as time allows)")
    parser.add_argument("--case", type=int, help="this one case of a target")
    asked = parser.parse_args()
    # declarations take minutes each where tangents are slow: they are asked for by name
    chosen = [TARGETS[name] for name in asked.target or sorted(TARGETS.keys() - {"declarations"})]
    if asked.case is not None and len(chosen) != 1:
        parser.error("--case needs one --target")
    if reason := sanitizers.missing():
        print(f"no sanitizers: {reason}", flush=True)
    groups = [group for native in (True, False) if (group := [t for t in chosen if t.native == native])]
    found = 0
    for group in groups:
        number, interrupted = _hunted(group, asked.seed, 60.0 * asked.minutes / len(groups), asked.case, asked.cases)
        found += number
        if interrupted:
            print("interrupted", flush=True)
            return 130
    print(f"{found} findings" if found != 1 else "1 finding", flush=True)
    return 1 if found else 0


def _hunted(targets: list[Target], seed: int, seconds: float, case: int | None, cases: int | None) -> tuple[int, bool]:
    """The number of findings, which are printed with what led to them, and whether it was broken off."""
    begin = said = time.monotonic()
    found, interrupted = 0, False
    done: Counter[str] = Counter()
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    if case is not None or cases is not None:
        targets = [replace(target, weight=1) for target in targets]
    rounds = {} if cases is None else {"rounds": cases}
    repeated = {"first": case, "rounds": 1, "processes": 1} if case is not None else rounds
    try:
        for outcome in hunt(targets, seed, seconds, **repeated):
            if isinstance(outcome, Finding):
                found += 1
                print(f"\n{outcome}", flush=True)
                continue
            done[outcome.name] += 1
            counts[outcome.name] += outcome.counts
            if time.monotonic() - said > EVERY:
                said = time.monotonic()
                print(f"{done.total()} cases, {found} findings so far", flush=True)
    except KeyboardInterrupt:
        interrupted = True
    examined = " under sanitizers" if targets[0].native and not sanitizers.missing() else ""
    cases = ", ".join(f"{target.name} {done[target.name]}" for target in targets)  # type: ignore[assignment]
    print(f"cases{examined}: {cases}; {found} findings in {time.monotonic() - begin:.0f} s", flush=True)
    for name, counted in counts.items():
        for what, number in counted.most_common():
            print(f"  {name}: {number:6d} {what}", flush=True)
    return found, interrupted


if __name__ == "__main__":
    sys.exit(main())
