"""A role for each column of a log, by name and by content, each with its confidence and the reason.

Name and content count as independent witnesses: 1 - (1 - name)(1 - content); content that forbids a role settles it. A
role that is not more likely than not is not proposed: a wrong proposal is worse than none.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from rig_io.description.content import Features, evidence, features
from rig_io.description.names import named, plain, unit_named
from rig_io.logs.columns import COLUMNS, TIME
from rig_io.logs.table import Table
from rig_io.logs.text_layout import unit_like

LIKELY = 0.6  # confidence from which on a role is proposed
ACROSS = "a force along the motion: 'stickslip hysteresis' fits it"
FOLLOWS = 0.9  # of the steps of a count at which a column of edge times must leap


@dataclass(frozen=True)
class Proposal:
    """For one column. role: None where none is likely; unit: what it is written in, None where nothing tells; header:
    the unit that the file states; confidence: of the role, 0 to 1; guessed: what of "role" and "unit" the file does not
    state outright, with the reason; kept: what an earlier sidecar says of it beside these."""

    name: str
    role: str | None
    unit: str | None
    header: str | None
    confidence: float
    reason: str
    guessed: Mapping[str, str]
    kept: Mapping[str, Any] = field(default_factory=dict)


def proposals(table: Table, stem: str = "") -> tuple[Proposal, ...]:
    """A proposal for every column of a table, in its order. stem: of the file's name, which speaks for a single column
    that has none."""
    contents = {name: features(values) for name, values in table.columns.items()}
    scores: list[tuple[float, str, str, str, str | None]] = []
    for name, content in contents.items():
        unit = _header_unit(table, name)
        if _is_row_number(name, content):
            continue
        column_name = name if not table.nameless else stem if len(table.columns) == 1 else ""
        by_name = named(column_name) if column_name else {}
        for role, judgement in evidence(content, unit, name in table.stamps).items():
            clear = by_name.get(role, 0.0)
            if not judgement.weight or (not clear and role not in _BY_CONTENT):
                continue
            reasons = ([f"its name says '{role}'"] if clear else []) + [judgement.reason]
            # a name that speaks for others speaks against this one
            against = 0.5 if by_name and not clear else 1.0
            confidence = 1 - (1 - clear) * (1 - against * judgement.weight)
            scores.append((confidence, name, role, ", ".join(reasons), judgement.unit))
    chosen = _assigned(scores, table)
    proposed = [_proposal(table, name, chosen.get(name)) for name in table.columns]
    clock = next((proposal for proposal in proposed if proposal.role == TIME.name), None)
    return tuple(_on_clock(proposal, clock) for proposal in proposed)


def _on_clock(column: Proposal, clock: Proposal | None) -> Proposal:
    """Edge times without a unit are in that of the clock."""
    if clock is None or column.unit is not None or column.role is None or not column.role.endswith("_edge_time"):
        return column
    return replace(column, unit=clock.unit, guessed={**column.guessed, "unit": f"that of '{clock.name}'"})


# roles that numbers alone may suggest
_BY_CONTENT = (
    "time",
    "encoder_count",
    "drive0_count",
    "drive0_speed",
    "laser",
    "angle",
    "encoder_edge_time",
    "load0",
    "temperature",
)


def _assigned(
    scores: Sequence[tuple[float, str, str, str, str | None]], table: Table
) -> dict[str, tuple[float, str, str, str | None]]:
    """The likeliest role of each column, each role once."""
    chosen: dict[str, tuple[float, str, str, str | None]] = {}
    taken: set[str] = set()
    for confidence, name, role, reason, unit in sorted(scores, key=lambda choice: -choice[0]):
        if name in chosen or confidence < LIKELY:
            continue
        if role.endswith("_edge_time"):
            role = _edges_of(table, name, chosen, role)
        if role not in taken:
            chosen[name] = (confidence, role, reason, unit)
            taken.add(role)
    counts = {role for _, role, _, _ in chosen.values()}
    return {
        name: choice
        for name, choice in chosen.items()
        if not choice[1].endswith("_edge_time") or choice[1].replace("_edge_time", "_count") in counts
    }


def _edges_of(table: Table, name: str, chosen: Mapping[str, tuple[float, str, str, str | None]], role: str) -> str:
    """The edge times that leap where a count steps are that count's."""
    leaps = np.diff(table.columns[name]) != 0
    for neighbour, (_, counted, _, _) in chosen.items():
        if counted.endswith("_count"):
            steps = np.diff(table.columns[neighbour]) != 0
            if steps.any() and np.mean(leaps[steps]) > FOLLOWS and np.mean(leaps) < 0.5 + np.mean(steps):
                edge_role = counted.replace("_count", "_edge_time")
                if np.mean(leaps == steps) > 0.9:
                    return edge_role
    return role


def _is_row_number(name: str, content: Features | None) -> bool:
    """Whether a column numbers the rows, as pandas writes them."""
    if content is None or not (content.whole and content.even and content.step == 1 and content.value[0] in (0, 1)):
        return False
    return not {"time"} & set(named(name)) or plain(name).startswith("column ")


def _header_unit(table: Table, name: str) -> str | None:
    unit = table.units.get(name)
    return unit if unit is not None and (unit in ("", "1") or unit_like(unit)) else None


def _proposal(table: Table, name: str, choice: tuple[float, str, str, str | None] | None) -> Proposal:
    header = _header_unit(table, name)
    if choice is None:
        reason = ACROSS if "friction" in named(name) else "nothing speaks for a role"
        return Proposal(name, None, header, header, 0.0, reason, {})
    confidence, role, reason, unit = choice
    guessed = {} if name == role else {"role": reason}
    if COLUMNS[role].whole:
        unit = "1"
    elif header is not None:
        unit = header
    elif (stated := unit_named(name, role)) is not None:
        unit, guessed["unit"] = stated, f"its name says '{stated}'"
    if unit is not None and header is None and not COLUMNS[role].whole and name not in table.stamps:
        guessed.setdefault("unit", f"looks like {unit}: {reason}")
    return Proposal(name, role, unit, header, confidence, reason, guessed)
