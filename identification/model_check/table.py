"""Families of drive speeds, model against measurement: tables, sentences, and both for a terminal (rich)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.digits import deviation, value_with_sd
from fmu_models.base.table import Cell, Table, table, verdict
from identification.model_check.bifurcations import COVER, BifurcationComparison, MeasuredBifurcation, Transition
from identification.model_check.portraits import MEANING, Portrait, Rest

if TYPE_CHECKING:
    from rich.console import Group

    from identification.model_check.families import FamilyComparison

TURNED = 6  # logs from which on they stand in rows: as columns they would not fit a terminal


def comparison_report(families: Sequence[FamilyComparison]) -> Group:
    """Metrics of each log with verdicts, sticks, bifurcations, and what a pass means."""
    from rich.console import Group
    from rich.text import Text

    parts = []
    for family in families:
        made = metrics_table(family)
        parts.append(made.turned() if len(family.members) >= TURNED else made)
        parts += [
            Text(f"{member.log}: measured {member.measured.words}; model {member.model.words}.")
            for member in family.members
        ]
        parts += [Text(sentence) for sentence in bifurcation_sentences(family)]
        parts += [Text(f"Note: {note}") for note in family.notes]
    return Group(*parts, Text(MEANING))


def metrics_table(family: FamilyComparison) -> Table:
    """A row for each metric, a column for each log, and the acceptance levels."""
    every = [verdict for member in family.members for verdict in member.verdicts]
    # a member whose motion has not settled judges less than others
    known = {verdict.name: verdict for verdict in sorted(every, key=lambda one: one.limit is not None)}
    known = {verdict.name: known[verdict.name] for verdict in every}
    rows: list[list[str | Cell]] = []
    for name, first in known.items():
        cells = []
        for one in family.members:
            found = next((v for v in one.verdicts if v.name == name), None)
            words = "" if found is None else shown(name, found.value, "+")
            failed = found is not None and found.passed is False
            cells.append(Cell(f"{words} FAIL", "fail") if failed else Cell(words, "number"))
        rows.append([name, Cell("not judged" if first.limit is None else shown(name, first.limit), "number"), *cells])
    rows.append(["verdict", "", *(verdict(member.passed) for member in family.members)])
    columns = ["metric", "accepted up to", *(f"{member.log}, {member.drives}" for member in family.members)]
    return table("Model against measurement", columns, rows)


def sequence_table(family: FamilyComparison) -> Table:
    """Per log: drive speeds, measured and modelled motion, shares of stick; which disc sticks when."""
    rows = [
        [member.log, member.drives, member.measured.words, member.model.words]
        + [Cell(_shares(motion), "number") for motion in (member.measured, member.model)]
        for member in family.members
    ]
    heads = ("log", "drive speeds", "measured", "model", "stick fraction, measured", "stick fraction, model")
    return table("Stick by disc, in order within a cycle", heads, rows)


def shown(metric: str, value: float, sign: str = "") -> str:
    """A metric as people read it; the stick fraction is a difference of shares, the others are relative."""
    if metric == "same motion":
        return "no" if value else "yes"
    return f"{value:{sign}.4g}" if metric.startswith("stick fraction") else f"{100 * value:{sign}.3g} %"


def bifurcation_sentences(family: FamilyComparison) -> list[str]:
    """What is predicted and measured of each bifurcation, in words."""
    found = [_sentence(bifurcation) for bifurcation in family.bifurcations]
    if family.hopf is not None:
        found.append(f"Steady sliding is stable above {family.hopf:.4g} rad/s (Hopf bifurcation of the model).")
    return found


def _sentence(one: BifurcationComparison) -> str:
    parts = []
    if one.predicted is not None:
        reach = COVER * one.predicted.deviation
        known = ""
        if np.isfinite(reach):
            noise, scale = (
                deviation(COVER * part) for part in (one.predicted.noise_deviation, one.predicted.scale_deviation)
            )
            least = "; at least" if one.predicted.at_least else ""
            known = f" (95 %; noise {noise}, rig constants {scale}{least})"
        parts.append(f"predicted at {speed_within(one.predicted.speed, reach)} rad/s{known}")
    if one.measured is not None:
        if np.isfinite(one.measured.high):
            parts.append(f"measured between {one.measured.low:.4g} and {one.measured.high:.4g} rad/s")
        else:
            parts.append(f"not reached by the logs, which stick up to {one.measured.low:.4g} rad/s")
        if one.measured.estimate is not None:
            text = f"carried on to no stick {measured_speed(one.measured)} rad/s"
            parts.append(text + (f" (the model alike: {one.alike:.4g})" if one.alike is not None else ""))
    agreed = {True: " They agree.", False: " They do not agree.", None: ""}[one.passed]
    what = one.predicted.words if one.predicted is not None else _change(one)
    return f"{what[0].upper()}{what[1:]}: {', '.join(parts)}.{agreed}"


def speed_within(speed: float, reach: float) -> str:
    """A drive speed and half its 95 % interval, rad/s; the speed alone where nothing is known of it."""
    return value_with_sd(speed, reach) if np.isfinite(reach) else f"{speed:.5g}"


def measured_speed(one: MeasuredBifurcation) -> str:
    """The drive speed at which stick ends when the measured stick is carried on, with half its 95 % interval, rad/s."""
    return speed_within(one.estimate or 0.0, COVER * (one.deviation or 0.0))


def _change(one: BifurcationComparison) -> str:
    measured = one.measured
    return "" if measured is None else Transition(measured.varied, measured.low, measured.before, measured.after).words


def _shares(motion: Portrait | Rest) -> str:
    if isinstance(motion, Rest):
        return "0"
    return ", ".join(f"{stick.fraction:.3f}" for stick in motion.sticks.values())
