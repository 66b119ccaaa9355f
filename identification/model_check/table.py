"""Families of drive speeds, model against measurement, as tables for a terminal (rich) and as plain rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from identification.model_check.portraits import MEANING, Portrait, Rest

if TYPE_CHECKING:
    from rich.console import Group

    from identification.model_check.bifurcations import BifurcationComparison
    from identification.model_check.families import FamilyComparison

TURNED = 6  # logs from which on they stand in rows: as columns they would not fit a terminal


def comparison_report(families: Sequence[FamilyComparison]) -> Group:
    """Metrics of each log with verdicts, sticks, bifurcations, and what a pass means."""
    from rich.console import Group
    from rich.text import Text

    from fmu_models.base.console import table

    parts = []
    for family in families:
        heads, rows = metric_rows(family)
        turned = len(family.members) >= TURNED
        lines = [heads, *rows]
        lines = [list(column) for column in zip(*lines, strict=True)] if turned else lines
        made = table(*(f">{head}" if i else head for i, head in enumerate(lines[0])), title="Model against measurement")
        for row in lines[1:]:
            made.add_row(*row)
        parts.append(made)
        parts += [Text(f"{one.log}: measured {one.measured.words}; model {one.model.words}.") for one in family.members]
        parts += [Text(sentence) for sentence in bifurcation_sentences(family)]
        parts += [Text(f"Note: {note}") for note in family.notes]
    return Group(*parts, Text(MEANING))


def metric_rows(family: FamilyComparison) -> tuple[list[str], list[list[str]]]:
    """Heading and rows: a row for each metric, a column for each log, and the acceptance levels."""
    names = list(dict.fromkeys(verdict.name for one in family.members for verdict in one.verdicts))
    known = {verdict.name: verdict for one in family.members for verdict in one.verdicts}
    rows = []
    for name in names:
        cells = []
        for one in family.members:
            verdict = next((v for v in one.verdicts if v.name == name), None)
            mark = "" if verdict is None else shown(name, verdict.value, "+")
            cells.append(mark + (" FAIL" if verdict is not None and verdict.passed is False else ""))
        limit = known[name].limit
        rows.append([name, *cells, "not judged" if limit is None else shown(name, limit)])
    rows.append(["verdict", *("pass" if one.passed else "FAIL" for one in family.members), ""])
    return ["", *(f"{one.log}\n{one.drives}" for one in family.members), "accepted up to"], rows


def shown(metric: str, value: float, sign: str = "") -> str:
    """A metric as people read it; the stick fraction is a difference of shares, the others are relative."""
    if metric == "same motion":
        return "no" if value else "yes"
    return f"{value:{sign}.4g}" if metric.startswith("stick fraction") else f"{100 * value:{sign}.3g} %"


def bifurcation_sentences(family: FamilyComparison) -> list[str]:
    """What is predicted and measured of each bifurcation, in words."""
    found = [_sentence(one) for one in family.bifurcations]
    if family.hopf is not None:
        found.append(f"Steady sliding is stable above {family.hopf:.4g} rad/s (Hopf bifurcation of the model).")
    return found


def _sentence(one: BifurcationComparison) -> str:
    parts = []
    if one.predicted is not None:
        reach = 1.96 * one.predicted.deviation
        known = ""
        if np.isfinite(reach):
            noise, scale = 1.96 * one.predicted.noise_deviation, 1.96 * one.predicted.scale_deviation
            known = f" +- {reach:.1g} (95 %; noise {noise:.1g}, rig constants {scale:.1g})"
        parts.append(f"predicted at {one.predicted.speed:.5g}{known} rad/s")
    if one.measured is not None:
        if np.isfinite(one.measured.high):
            parts.append(f"measured between {one.measured.low:.4g} and {one.measured.high:.4g} rad/s")
        else:
            parts.append(f"not reached by the logs, which stick up to {one.measured.low:.4g} rad/s")
        if one.measured.estimate is not None:
            reach = 1.96 * (one.measured.deviation or 0.0)
            text = f"carried on to no stick {one.measured.estimate:.4g} +- {reach:.1g} rad/s"
            parts.append(text + (f" (the model alike: {one.alike:.4g})" if one.alike is not None else ""))
    verdict = {True: " They agree.", False: " They do not agree.", None: ""}[one.passed]
    what = one.predicted.words if one.predicted is not None else _change(one)
    return f"{what[0].upper()}{what[1:]}: {', '.join(parts)}.{verdict}"


def _change(one: BifurcationComparison) -> str:
    from identification.model_check.bifurcations import Transition

    measured = one.measured
    return "" if measured is None else Transition(measured.varied, measured.low, measured.before, measured.after).words


def sequence_rows(family: FamilyComparison) -> list[list[str]]:
    """Per log: name, drive speeds, measured and modelled motion, shares of stick."""
    return [
        [one.log, one.drives, one.measured.words, one.model.words, _shares(one.measured), _shares(one.model)]
        for one in family.members
    ]


def _shares(motion: Portrait | Rest) -> str:
    if isinstance(motion, Rest):
        return "0"
    return ", ".join(f"{stick.fraction:.3f}" for stick in motion.sticks.values())
