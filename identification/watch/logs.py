"""New logs of a watched folder: found once their size rests, described as the first, fitted alone."""

import hashlib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError, StickslipWarning
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.inference.defaults import NONE
from identification.measurement.pooled import Pool
from identification.measurement.pooling import pool
from identification.measurement.sensor_checks import stick_ratio
from identification.watch.chart import FIRST, control_chart
from identification.watch.state import DECAY, FITTED, REFUSED, Entry, WatchState
from rig_io.description.answers import Answers
from rig_io.description.draft import draft, write
from rig_io.description.example import log_files
from rig_io.description.questions import missing
from rig_io.logs.log import RigLog
from rig_io.packages.datapackage import read_log
from rig_io.packages.described import files_of
from rig_io.packages.sidecar import SIDECAR, file_hash, load_json

RATIO = "stick ratio"  # of the disc's border to the driving disc, in stick; 1 unless the drive slips
WORN = "wear"
SLIPPED = 0.02  # by which the ratio may fall before the drive is said to slip


@dataclass(frozen=True)
class FileStates:
    """Files of one log as they are: name -> size in bytes and time of change in ns."""

    name: str
    files: Mapping[str, tuple[int, int]]


def seen_logs(folder: Path) -> list[FileStates]:
    """The logs in a folder, those that are described first, in their order; others by their names. StickslipError: the
    folder is not there."""
    if not folder.is_dir():
        raise StickslipError(f"The folder '{folder}' is not there.")
    resources = load_json(folder / SIDECAR)["resources"] if (folder / SIDECAR).exists() else []
    groups = [files_of(resource) for resource in resources]
    described = {name for files in groups for name in files}
    others = [(path.name,) for path in log_files(folder) if path.name not in described]
    seen = []
    for files in (*groups, *others):
        try:
            marks = {name: ((folder / name).stat().st_size, (folder / name).stat().st_mtime_ns) for name in files}
        except OSError:
            continue  # renamed or removed meanwhile
        if all(size for size, _ in marks.values()):
            seen.append(FileStates(files[0], marks))
    return seen


def deal_with(folder: Path, seen: FileStates, state: WatchState) -> Entry:
    """Describe and fit one log; what it gives, or why it is refused."""
    checksum = hashlib.sha256("".join(file_hash(folder / name) for name in seen.files).encode()).hexdigest()
    recorded = max(at for _, at in seen.files.values()) * 1e-9
    twin = state.twin(checksum)
    if twin is not None and twin.name != seen.name:
        return Entry(seen.name, seen.files, checksum, recorded, REFUSED, f"the same data as '{twin.name}'")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", StickslipWarning)
            _describe(folder, seen)
            log = read_log(folder / seen.name)
            silent = silent_columns(log)
            if log.kind == "free-decay":
                return Entry(seen.name, seen.files, checksum, recorded, DECAY, "", {}, silent)
            ready = pool([log, *_decays(folder, seen.name)])
            # what is charted is to be the same from log to log, whatever a log shows beside it
            fit = fit_friction(ready, estimator=state.estimator, law=state.law, disturbances=NONE, law_spread=NONE)
        values = {parameter.name: (parameter.value, parameter.standard_deviation) for parameter in fit.parameters}
        entry = Entry(seen.name, seen.files, checksum, recorded, FITTED, "", values | _ratio(ready, fit), silent)
    except StickslipError as error:
        return Entry(seen.name, seen.files, checksum, recorded, REFUSED, str(error), silent=_silent(folder, seen))
    return entry


def _describe(folder: Path, seen: FileStates) -> None:
    """Write a log into the sidecar, as the first one is described; not if it stands there already."""
    resources = load_json(folder / SIDECAR)["resources"] if (folder / SIDECAR).exists() else []
    if any(seen.name in files_of(resource) for resource in resources):
        return
    if not resources:
        raise StickslipError(f"No log in '{folder}' is described. Describe the first: stickslip describe {folder}.")
    description = draft([folder / seen.name], Answers(), like=folder)
    if lacking := missing(description):
        raise StickslipError(f"It is not of the recorder that is described: {' '.join(lacking)}")
    write(description)


def _decays(folder: Path, name: str) -> list[RigLog]:
    """The first free decay that is described beside."""
    for resource in load_json(folder / SIDECAR)["resources"]:
        if resource.get("experiment", {}).get("kind") == "free-decay" and files_of(resource)[0] != name:
            return [read_log(folder / files_of(resource)[0])]
    return []


def silent_columns(log: RigLog) -> tuple[str, ...]:
    """Columns that show nothing: one value throughout, or hardly a number."""
    silent = []
    for name, values in log.columns.items():
        good = values[np.isfinite(values)]
        if len(good) < 0.5 * len(values) or not np.ptp(good) > 0:
            silent.append(name)
    return tuple(silent)


def _silent(folder: Path, seen: FileStates) -> tuple[str, ...]:
    """Silent columns of a log that was refused, if it can be read."""
    try:
        return silent_columns(read_log(folder / seen.name))
    except (StickslipError, StickslipWarning):
        return ()


def _ratio(ready: Pool, fit: FrictionFit) -> dict[str, tuple[float, float]]:
    """Border of the disc over driving disc while they stick; it needs one driving disc."""
    if len(ready.contacts) != 1:
        return {}
    R, r = fit.constant("R"), fit.constant("r")
    ratios = [stick_ratio(motion, r.value, R.value, ready.natural_period / 20) for motion in ready.motions]
    positive = [ratio for ratio, share in ratios if share > 0]
    if not positive:
        return {}
    sd = np.hypot(R.standard_uncertainty / R.value, r.standard_uncertainty / r.value)
    return {RATIO: (float(np.mean(positive)), float(max(sd, 2e-3)))}


def called(state: WatchState, entry: Entry) -> tuple[str, ...]:
    """The sentences of the charts on one more log.

    wear: a parameter of the law left its limits; a lost sensor: a column that moved in the first logs stands still; a
    drive that slips: the disc follows it less closely in stick than it did.
    """
    before = state.fitted()
    calls = []
    usual = [e for e in before[:FIRST] if e.name != entry.name]
    lost = [name for name in entry.silent if usual and all(name not in e.silent for e in usual)]
    calls += [f"lost sensor: '{name}' shows nothing" for name in lost]
    if entry.status == REFUSED and not lost and usual and "lacks" in entry.reason:
        calls.append(f"lost sensor: {entry.reason}")
    if entry.status != FITTED:
        return tuple(calls)
    every = [e for e in before if e.name != entry.name and e.recorded <= entry.recorded] + [entry]
    for name in entry.values:
        series = [e.values[name] for e in every if name in e.values]
        chart = control_chart([value for value, _ in series], [sd for _, sd in series])
        if name == RATIO:
            if entry.values[name][0] < chart.target * (1 - SLIPPED):
                fall = 100 * (1 - entry.values[name][0] / chart.target)
                calls.append(f"the drive slips: in stick the disc turns {fall:.1f} % slower than it did")
        elif chart.out[-1]:
            change = chart.level[-1] - chart.target
            calls.append(f"{WORN}: {name} has moved by {change:+.2g} from {chart.target:.4g}")
    return tuple(calls)


def rested(
    seen: Sequence[FileStates],
    before: Mapping[str, tuple[Mapping[str, tuple[int, int]], float]],
    now: float,
    rest: float,
) -> tuple[list[FileStates], dict[str, tuple[Mapping[str, tuple[int, int]], float]]]:
    """Logs whose size and time have not changed for ``rest`` s; and since when each is as it is."""
    since = {}
    ready = []
    for log in seen:
        files, start = before.get(log.name, (log.files, now))
        since[log.name] = (log.files, start if files == log.files else now)
        if now - since[log.name][1] >= rest:
            ready.append(log)
    return ready, since
