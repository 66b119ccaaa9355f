"""Command that watches a folder: new logs are described, fitted and charted."""

from __future__ import annotations

import json as json_text
import time
from contextlib import nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fmu_models.base import console
from fmu_models.base.errors import StickslipError
from fmu_models.base.files import checked_page, existing
from fmu_models.base.printable import printable_json
from identification.inference.defaults import ESTIMATOR, LAW

if TYPE_CHECKING:
    from identification.watch.logs import FileStates
    from identification.watch.state import Entry, WatchState

STATE = ".stickslip-watch.json"


@console.trusting
def watch(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Of the logs; the first of them is described.")],
    law: Annotated[str | None, typer.Option(help=f"Friction law (default: that of the last time, or {LAW}).")] = None,
    estimator: Annotated[str | None, typer.Option(help="As for 'fit' (default: that of the last time).")] = None,
    page: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Page (.html), written anew with every log.")
    ] = None,
    state: Annotated[
        Path | None, typer.Option(metavar="FILE", help="What is known, to go on with. [default: in the folder]")
    ] = None,
    interval: Annotated[float, typer.Option(help="Between looks, s.", min=0.05)] = 2.0,
    rest: Annotated[float, typer.Option(help="A file counts once it has not changed for so long, s.", min=0.0)] = 3.0,
    once: Annotated[bool, typer.Option("--once", help="Deal with what is there, and end.")] = False,
    json: console.Json = False,
) -> None:
    """Watch a folder: each new log is described as the first, fitted, and charted; Ctrl-C ends it, nothing is lost.

    Called are wear (a parameter leaves its limits), a lost sensor, a drive that slips. Nothing is fitted twice.

    Example: stickslip watch data/rigs/paper_rubber --once --state watch.json --json
    """
    file = state or folder / STATE
    if not file.exists():  # one that was watched may come back
        existing(folder, "folder of logs")
    if page is not None:
        checked_page(page, overwrite=True)
    known = _begun(file, law, estimator)
    try:
        known = _watch(folder, known, file, page, (interval, rest), once, json)
    except KeyboardInterrupt:
        from identification.watch.state import read_state

        known = read_state(file) if file.exists() else known
    if json and once:
        console.say(True, known.to_dict(), lambda out: None)


def _begun(file: Path, law: str | None, estimator: str | None) -> WatchState:
    from identification.watch.state import REFUSED, WatchState, read_state

    before = read_state(file) if file.exists() else WatchState(law or LAW, estimator or ESTIMATOR)
    if (law or before.law, estimator or before.estimator) != (before.law, before.estimator):
        raise StickslipError(
            f"'{file}' holds fits of the law {before.law} by {before.estimator}. Go on with those, or name another "
            "state: --state FILE."
        )
    # what was refused is tried again: its description may have been mended
    return replace(before, entries=tuple(entry for entry in before.entries if entry.status != REFUSED))


def _watch(
    folder: Path, known: WatchState, file: Path, page: Path | None, pace: tuple[float, float], once: bool, json: bool
) -> WatchState:
    from rich.live import Live

    from identification.watch.logs import rested, seen_logs
    from identification.watch.page import watch_table

    interval, rest = pace
    out = console.console()
    live = Live(console=out, auto_refresh=False) if out.is_terminal and not json else None
    since: dict[str, Any] = {}
    gone = False
    with live or nullcontext():
        while True:
            try:
                seen = seen_logs(folder)
                gone = False
            except StickslipError as error:
                if once:
                    raise
                if not gone:
                    console.warn(f"{error} It is waited for.")
                gone, seen = True, []
            ready, since = rested(seen, since, time.monotonic(), 0.0 if once else rest)
            for one in ready:
                if not known.knows(one.files):
                    known = _dealt_with(folder, one, known, file, page, interval)
                    if not (json and once):
                        _say(known.entries[-1], live is not None, json)
            if live is not None:
                live.update(watch_table(known, last=out.height - 6), refresh=True)
            if once:
                return known
            time.sleep(interval)


def _dealt_with(
    folder: Path, one: FileStates, known: WatchState, file: Path, page: Path | None, interval: float
) -> WatchState:
    from identification.watch.logs import called, deal_with
    from identification.watch.page import write_page
    from identification.watch.state import write_state

    entry = deal_with(folder, one, known)
    known = known.with_entry(replace(entry, calls=called(known, entry)))
    if folder.is_dir() or file.parent.is_dir():
        write_state(file, known)
    if page is not None:
        write_page(page, known, folder, interval)
    return known


def _say(entry: Entry, live: bool, json: bool) -> None:
    """A line for a log, where there is no live table."""
    if json:
        print(printable_json(json_text.dumps(asdict(entry), ensure_ascii=False)), flush=True)
    elif not live:
        values = ", ".join(f"{name} {value:.4g} +- {sd:.1g}" for name, (value, sd) in entry.values.items())
        reasons = "; ".join((*entry.calls, *((entry.reason,) if entry.reason else ())))
        console.console().print(console.plain(f"{entry.name}: {entry.status} {values} {reasons}".rstrip()))
