"""Run every FMU that is given, here and by tools that are not ours, and say of each: pass, refused, wrong, crashed,
timed out.

    python -m tests.farm FOLDER|FILE|NAME ...    NAME: an oscillator, "oscillators", a package, "packages"

Ctrl-C keeps what is finished. The exit code is 1 if an FMU is wrong or crashed, 130 after Ctrl-C.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.table import Table

from fmu_models import oscillators
from fmu_models.base.child_process import Limits
from fmu_models.base.errors import StickslipError, nearest
from fmu_models.base.processes import in_processes
from fmu_models.codegen.package import FMI_VERSIONS, built
from tests.farm.packages import PACKAGES, fmus
from tests.farm.runs import JOBS, run
from tests.farm.verdict import CRASHED, SEVERITY, WRONG, Outcome, Verdict, judged

FAILURES = (WRONG, CRASHED)
COLUMNS = ("fmu", "maker", "interfaces", "verdict", "reason", "remarks")


def named(name: str) -> list[Path]:
    """The FMUs of a folder, a file, an oscillator or a package. StickslipError: none of them."""
    path = Path(name)
    if path.is_dir():
        return sorted(path.rglob("*.fmu"))
    if path.is_file():
        return [path]
    if name in ("oscillators", *oscillators.names()):
        models = oscillators.names() if name == "oscillators" else [name]
        return [built(model, fmi_version=version) for model in models for version in FMI_VERSIONS]
    packages = [package for package in PACKAGES if name in ("packages", package.name)]
    if not packages:
        known = ("oscillators", "packages", *oscillators.names(), *(package.name for package in PACKAGES))
        raise StickslipError(f"'{name}' is no folder, file, oscillator or package.{nearest(name, known)}")
    return [path for package in packages for path in fmus(package)]


def farm(paths: Iterable[Path], *, workers: int = 2, seconds: float = 60.0, until: float | None = None) -> Iterator:
    """The verdict of each FMU as it is reached; each has processes of its own, and each run a limit of time, s."""
    limits = Limits(seconds, Limits.default().memory)
    for path in paths:
        jobs = [(path.resolve(), tool, interface, until) for tool, interface in JOBS]
        outcomes: dict[tuple[str, str], Outcome] = {}
        for number, outcome in in_processes(run, jobs, processes=workers, limits=limits, threads=1):
            outcomes[JOBS[number]] = outcome
        yield judged(path, outcomes)


def rows(verdicts: Sequence[Verdict]) -> pd.DataFrame:
    """(n, 6) one row per FMU."""
    cells = [(str(v.path), v.heading, " ".join(v.interfaces), v.word, v.reason, "; ".join(v.remarks)) for v in verdicts]
    return pd.DataFrame(cells, columns=pd.Index(COLUMNS))


def write(verdicts: Sequence[Verdict], folder: Path) -> None:
    """farm.csv and farm.md with a row per FMU, farm_variables.csv with one per comparison of a variable."""
    folder.mkdir(parents=True, exist_ok=True)
    table = rows(verdicts)
    table.to_csv(folder / "farm.csv", index=False)
    lines = [" | ".join(COLUMNS), " | ".join("-" * 3 for _ in COLUMNS)]
    lines += [" | ".join(str(cell).replace("|", "\\|") for cell in row) for row in table.itertuples(index=False)]
    text = "\n".join(f"| {line} |" for line in lines)
    (folder / "farm.md").write_text(f"{counts(verdicts)}\n\n{text}\n", encoding="utf-8")
    details = [
        (str(v.path), c.interface, c.judge, d.variable, d.worst, WRONG if d.worst > 1 else "", d.time, d.ours, d.judge)
        for v in verdicts
        for c in v.comparisons
        for d in c.differences
    ]
    head = ("fmu", "interface", "judge", "variable", "tolerances", "differs", "time", "ours", "judged by")
    pd.DataFrame(details, columns=pd.Index(head)).to_csv(folder / "farm_variables.csv", index=False)


def counts(verdicts: Sequence[Verdict]) -> str:
    """How many FMUs of each verdict, of how many makers."""
    number = Counter(v.word for v in verdicts)
    makers = {v.heading.partition(", ")[2].split(" ")[0] for v in verdicts if v.heading}
    words = ", ".join(f"{number[word]} {word}" for word in SEVERITY)
    return f"{len(verdicts)} FMUs of {len(makers)} makers: {words}"


def main(arguments: Sequence[str] | None = None) -> int:
    """The exit code."""
    parser = argparse.ArgumentParser(prog="python -m tests.farm", description=str(__doc__).split("\n\n")[0])
    parser.add_argument("what", nargs="+", metavar="FOLDER|FILE|NAME")
    parser.add_argument("--workers", type=int, default=2, help="processes at a time (default: 2)")
    parser.add_argument("--limit", type=float, default=60.0, help="s for a run (default: 60)")
    parser.add_argument("--until", type=float, help="s, end of the runs (default: as beside or in the FMU)")
    parser.add_argument("--output", type=Path, default=Path("farm"), help="folder of the tables (default: farm)")
    asked = parser.parse_args(arguments)
    console, verdicts, interrupted = Console(), [], False
    try:
        paths = list(dict.fromkeys(path for name in asked.what for path in named(name)))
        for verdict in farm(paths, workers=max(1, asked.workers), seconds=asked.limit, until=asked.until):
            verdicts.append(verdict)
            console.print(f"{len(verdicts)}/{len(paths)} {verdict.word}: {verdict.path}", markup=False, highlight=False)
    except StickslipError as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        interrupted = True
    table = Table(*COLUMNS[:-1])
    for row in rows(verdicts).itertuples(index=False):
        table.add_row(*(str(cell) for cell in (Path(str(row[0])).name, *row[1:-1])))
    console.print(table)
    write(verdicts, asked.output)
    console.print(counts(verdicts) + (", interrupted" if interrupted else ""), highlight=False)
    if not verdicts and not interrupted:
        print("There is no FMU there.", file=sys.stderr)
        return 2
    return 130 if interrupted else int(any(v.word in FAILURES for v in verdicts))


if __name__ == "__main__":
    raise SystemExit(main())
