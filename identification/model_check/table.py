"""Families of drive speeds, model against measurement: tables, sentences, and both for a terminal (rich)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fmu_models.base.digits import deviation, value_with_sd
from fmu_models.base.table import Cell, PrintedTable, table, verdict
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

    blocks = []
    for family in families:
        metrics = metrics_table(family)
        blocks.append(metrics.turned() if len(family.members) >= TURNED else metrics)
        blocks += [
            Text(f"{member.log}: measured {member.measured.words}; model {member.model.words}.")
            for member in family.members
        ]
        blocks += [Text(sentence) for sentence in bifurcation_sentences(family)]
        blocks += [Text(f"Note: {note}") for note in family.notes]
    return Group(*blocks, Text(MEANING))


def metrics_table(family: FamilyComparison) -> PrintedTable:
    """A row for each metric, a column for each log, and the acceptance levels."""
    every = [verdict for member in family.members for verdict in member.verdicts]
    # a member whose motion has not settled judges less than others
    verdicts = {verdict.name: verdict for verdict in sorted(every, key=lambda v: v.limit is not None)}
    verdicts = {verdict.name: verdicts[verdict.name] for verdict in every}
    rows: list[list[str | Cell]] = []
    for name, first in verdicts.items():
        cells = []
        for member in family.members:
            entry = next((v for v in member.verdicts if v.name == name), None)
            words = "" if entry is None else shown(name, entry.value, "+")
            failed = entry is not None and entry.passed is False
            cells.append(Cell(f"{words} FAIL", "fail") if failed else Cell(words, "number"))
        rows.append([name, Cell("not judged" if first.limit is None else shown(name, first.limit), "number"), *cells])
    rows.append(["verdict", "", *(verdict(member.passed) for member in family.members)])
    columns = ["metric", "accepted up to", *(f"{member.log}, {member.drives}" for member in family.members)]
    return table("Model against measurement", columns, rows)


def sequence_table(family: FamilyComparison) -> PrintedTable:
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
    sentences = [_sentence(bifurcation) for bifurcation in family.bifurcations]
    if family.hopf is not None:
        sentences.append(f"Steady sliding is stable above {family.hopf:.4g} rad/s (Hopf bifurcation of the model).")
    return sentences


def _sentence(pair: BifurcationComparison) -> str:
    clauses = []
    if pair.predicted is not None:
        reach = COVER * pair.predicted.deviation
        interval = ""
        if np.isfinite(reach):
            noise, scale = (
                deviation(COVER * sd) for sd in (pair.predicted.noise_deviation, pair.predicted.scale_deviation)
            )
            least = "; at least" if pair.predicted.at_least else ""
            interval = f" (95 %; noise {noise}, rig constants {scale}{least})"
        clauses.append(f"predicted at {speed_within(pair.predicted.speed, reach)} rad/s{interval}")
    if pair.measured is not None:
        if np.isfinite(pair.measured.high):
            clauses.append(f"measured between {pair.measured.low:.4g} and {pair.measured.high:.4g} rad/s")
        else:
            clauses.append(f"not reached by the logs, which stick up to {pair.measured.low:.4g} rad/s")
        if pair.measured.estimate is not None:
            text = f"carried on to no stick {measured_speed(pair.measured)} rad/s"
            clauses.append(text + (f" (the model alike: {pair.alike:.4g})" if pair.alike is not None else ""))
    vague = " They are not told apart: too little is known of them." if pair.predicted and pair.measured else ""
    agreed = {True: " They agree.", False: " They do not agree.", None: vague}[pair.passed]
    title, seen = "" if pair.predicted is None else pair.predicted.words, pair.measured
    if pair.predicted is None and seen is not None:
        title = Transition(seen.varied, seen.low, seen.before, seen.after).words
    return f"{title[0].upper()}{title[1:]}: {', '.join(clauses)}.{agreed}"


def speed_within(speed: float, reach: float) -> str:
    """A drive speed and half its 95 % interval, rad/s; the speed alone where nothing is known of it."""
    return value_with_sd(speed, reach) if np.isfinite(reach) else f"{speed:.5g}"


def measured_speed(measured: MeasuredBifurcation) -> str:
    """The drive speed at which stick ends when the measured stick is carried on, with half its 95 % interval, rad/s."""
    return speed_within(measured.estimate or 0.0, COVER * (measured.deviation or 0.0))


def _shares(motion: Portrait | Rest) -> str:
    if isinstance(motion, Rest):
        return "0"
    return ", ".join(f"{stick.fraction:.3f}" for stick in motion.sticks.values())
