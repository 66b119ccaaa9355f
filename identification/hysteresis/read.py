"""Logs of force against displacement from files of any kind: which column is what, in which unit, which way round."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.unit_names import conversion
from identification.hysteresis.loop import LoopLog
from identification.hysteresis.spectrum import fit_sliders
from rig_io.logs.table import Table
from rig_io.readers import read_table

# what columns are for, and what they are called where nobody says it
ROLES = {
    "time": r"t(ime)?|zeit",
    "way": r"x|u|way|weg|stroke|disp\w*|pos\w*|deform\w*|drift",
    "force": r"f|p|kraft|force|friction|restoring\w*|load|load cell",
    "load": r"n|normal( force)?|preload|clamp\w*",
}
UNITS = {"time": "s", "way": "m", "force": "N", "load": "N"}
# of tables without names, by the number of their columns; a first column that rises is the time
NAMELESS = {2: ("way", "force"), 3: ("time", "way", "force"), 4: ("time", "way", "", "force")}
SPANS = {"way": (1e-9, 5.0), "force": (1e-9, 1e10)}  # m and N that a log may go over: more is of another unit
FEWEST = 20  # samples
ROUGHLY = 2000  # samples by which it is judged which way round a log is
NO_LOAD = 0.05  # of the median: less is next to none
COARSE = 50  # samples a cycle, below which peaks are missed
_CONDITION = re.compile(r"(?<![\d.])(\d+(?:[x.p]\d+)?)(mm|um|Hz|mHz|kN|N|MPa|A|V|C|K|rpm)(?![a-z])")


def read_loop(
    path: str | Path,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    reader: str | None = None,
    signals: Sequence[str] = (),
) -> LoopLog:
    """A log of force against displacement. path: of a file of any kind that is read; columns: by role (way, force,
    time, load) where names do not tell; units: by role, where the file does not state them and they are not m, N and s;
    reader: of the user, for a kind of file of his own; signals: names of columns that are kept in units of their own,
    where there are such. StickslipError: the file cannot be read, a column is missing or has no numbers, loops that run
    backwards."""
    path = Path(path)
    table = read_table(path, reader)
    named = columns_by_role(table, columns or {}, ROLES, ("way", "force"), NAMELESS)
    chosen = {name: column for column in table.columns for name in signals if name in (column, bare(column))}
    scaled, unstated = numbers_by_role(table, {**chosen, **named}, units or {}, UNITS)
    count, rows = len(scaled["way"]), len(table.columns[named["way"]])
    if count < FEWEST:
        raise StickslipError(
            f"{table.source}: {count} rows hold numbers in {', '.join(named.values())}; a loop needs {FEWEST}."
        )
    notes = [] if count == rows else [f"{path.name}: {rows - count} rows without numbers are left out."]
    taken = [f"{named[role]} in {UNITS[role]}" for role in unstated if role != "load" and role in named]
    if taken:
        notes.append(f"{path.name} states no units: taken are {', '.join(taken)} (say others: --unit way=mm).")
    way, force = scaled["way"], scaled["force"]
    log = LoopLog(path.name, way, force, scaled.get("time"), scaled.get("load"), conditions_of(path.stem))
    return checked(replace(log, signals={name: scaled[name] for name in chosen}, notes=tuple(notes)))


def conditions_of(name: str) -> dict[str, float]:
    """What the name of a file says of the run, by unit.

    >>> conditions_of("mr_25mm0x25Hz0x5A")
    {'mm': 25.0, 'Hz': 0.25, 'A': 0.5}
    """
    return {unit: float(re.sub("[xp]", ".", number)) for number, unit in _CONDITION.findall(name)}


def columns_by_role(
    table: Table,
    given: Mapping[str, str],
    roles: Mapping[str, str],
    needed: Sequence[str],
    nameless: Mapping[int, Sequence[str]],
) -> dict[str, str]:
    """Columns of a table by role. given: by role, as the user says, empty where there is none; roles: patterns of
    names, in small letters, by role; needed: roles that a table must have; nameless: roles of the columns of a table
    without names, by their number. StickslipError: an unknown role or column, or a needed one that no name tells."""
    for role, column in given.items():
        refuse_unknown(role, roles, f"There is no role '{role}'.")
        if column:
            refuse_unknown(column, table.columns, f"{table.source} has no column '{column}'.")
    roles = {role: pattern for role, pattern in roles.items() if given.get(role, role)}
    given = {role: column for role, column in given.items() if column}
    names = [name for name in table.columns if name not in given.values()]
    by_role = dict(given)
    if not given and (table.nameless or all(re.fullmatch(r".*\d", name) for name in names)):
        order = nameless.get(len(names), ())
        if len(order) == 3 and not np.all(np.diff(table.columns[names[0]]) > 0):
            order = (*order[1:], "load")
        by_role |= {role: name for role, name in zip(order, names, strict=False) if role}
    for role, pattern in roles.items():
        words = {name: bare(name).lower() for name in names if name not in by_role.values()}
        matches = [name for name, word in words.items() if re.fullmatch(pattern, word)]
        if role not in by_role and matches:
            by_role[role] = matches[0]
    for role in needed:
        if role not in by_role:
            raise StickslipError(
                f"{table.source}: no column is known as the {role}; there are {', '.join(table.columns)}. Say which: "
                f"--column {role}=NAME."
            )
    return by_role


def bare(column: str) -> str:
    """The name of a column without its unit."""
    return re.sub(r"[\[(].*", "", column).strip()


def numbers_by_role(
    table: Table, named: Mapping[str, str], units: Mapping[str, str], expected: Mapping[str, str]
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Columns (n,) in the units ``expected`` by role, of the rows that have numbers in all of them; and the roles that
    are taken to be in them, for want of a unit. named: columns by role; units: by role, as the user says.
    StickslipError: a unit that cannot be converted, or times that do not rise."""
    values = {role: np.asarray(table.columns[column], dtype=float) for role, column in named.items()}
    good = np.all([np.isfinite(column) for column in values.values()], axis=0)
    scaled, unstated = {}, []
    for role, column in named.items():
        unit = units.get(role) or table.units.get(column) if role in expected else None
        if unit is None:
            unstated.append(role)
        factor = 1.0 if unit is None else conversion(unit, expected[role], f"{table.source}: column '{column}'")
        scaled[role] = factor * values[role][good]
    if np.any(np.diff(scaled.get("time", np.zeros(0))) <= 0):
        raise StickslipError(f"{table.source}: its times run back or stand still. Sort its rows, drop doubled ones.")
    return scaled, unstated


def checked(log: LoopLog) -> LoopLog:
    """The log with its force the right way round, and with what its user should know; itself where it was checked
    before. StickslipError: a way or force that never changes or is in another unit, a load that is always zero, columns
    that are swapped."""
    if log.checked:
        return log
    if log.range == 0 or np.ptp(log.force) == 0:
        raise StickslipError(
            f"{log.name}: its {'way' if log.range == 0 else 'force'} never changes. Check the columns."
        )
    for role, (least, most) in SPANS.items():
        if not least <= (span := float(np.ptp(getattr(log, role)))) <= most:
            raise StickslipError(
                f"{log.name}: its {role} goes over {span:.3g} {UNITS[role]}; expected are {least:g} to {most:g} "
                f"{UNITS[role]}. Say its unit, such as --unit {role}={'mm' if role == 'way' else 'kN'}."
            )
    notes = list(log.notes)
    turned = replace(log, force=-log.force) if log.work < 0 else log
    rough = replace(turned.part(0, None, max(len(log.way) // ROUGHLY, 1)), time=None, load=None)
    swapped = replace(rough, way=-rough.force, force=rough.way)
    left, by_swap = (fit_sliders([one]).left(one) for one in (rough, swapped))
    if by_swap < 0.5 * left:
        effect = f"with way and force exchanged {100 * by_swap:.2g} % are left of its loops for {100 * left:.2g} %"
        hint = "Say --column way=NAME --column force=NAME."
        if log.work < 0:
            raise StickslipError(f"{log.name} runs backwards, and {effect}: their columns are swapped. {hint}")
        notes.append(f"{log.name}: {effect}. Are the columns swapped? {hint}")
    if log.work < 0:
        log = turned
        notes.append(f"The force of {log.name} drives the way over its loops: its sign was turned.")
    per_cycle = log.samples_per_cycle
    if len(log.turns) > 0.6 * len(log.way):
        notes.append(f"{log.name} holds little more than peaks: what is between them is not seen.")
    elif per_cycle < COARSE:
        notes.append(
            f"{log.name} has about {per_cycle:.0f} samples a cycle, which miss peaks: with 20 the stiffness comes out "
            "some 3 % high, and so does the sliding force."
        )
    if log.load is not None and not np.any(log.load):
        raise StickslipError(f"{log.name}: its load is always zero. Leave it out: --column load=")
    if log.load is not None and log.load.min() * log.load.max() < -NO_LOAD * np.median(np.abs(log.load)) ** 2:
        notes.append(
            f"The load of {log.name} changes its sign, and a contact does not pull. Check its zero, or leave it out: "
            "--column load="
        )
    if log.load is not None and np.min(np.abs(log.load)) < NO_LOAD * np.median(np.abs(log.load)):
        notes.append(f"The load of {log.name} is near zero at times: there its force says little of the law.")
    log = replace(log, notes=tuple(dict.fromkeys(notes)))
    object.__setattr__(log, "checked", True)
    return log
