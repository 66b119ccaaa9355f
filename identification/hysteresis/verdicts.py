"""What loops of force over displacement leave open, and what in them no law of the way can be."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from identification.hysteresis.loop import LoopLog, saturated, stops
from identification.hysteresis.read import ROUGHLY
from identification.hysteresis.spectrum import SliderSpectrum, fit_sliders

PLAYS = 24  # widths of a backlash that are tried
POOR = 0.05  # of the force: what sliders leave at least where a backlash is looked for
OPEN = 0.05  # of the range of the force: a drift that is said
SURE = 4.0  # standard deviations of it


def verdicts(logs: Sequence[LoopLog], spectrum: SliderSpectrum, varied: bool) -> list[str]:
    """What the logs leave open, in sentences; ``varied``: the sliders grow with conditions."""
    notes = []
    if spectrum.is_rigid():
        notes.append(
            f"The stiffness is not determined: it is larger than {spectrum.stiffness_at_rest():.3g} N/m, for the force "
            f"has risen where the way has gone {spectrum.bound.min():.2g} m."
        )
    if not spectrum.slides.any() or spectrum.sliding_force() == 0:
        notes.append("Nothing gives way within these loops: a spring tells all that they show.")
    if spectrum.spring_beside() < -0.05 * spectrum.stiffness_at_rest():
        notes.append("The spring beside the sliders is negative: a force that falls with the way, which no slider has.")
    for log in logs:
        notes += [*_drift(log, spectrum), *_backlash(log)]
        if log.load is None or (left := spectrum.left(log)) == 0:
            continue
        ignored = replace(log, load=None)
        without = fit_sliders([ignored], rate=spectrum.rate).left(ignored)
        notes.append(
            f"The force of {log.name} is taken in proportion to its load: {100 * left:.3g} % are left of "
            f"it, {100 * without:.3g} % where the load is ignored."
        )
    if varied:
        notes.append("Laws are fitted to logs of one condition: name these alone, without factors.")
    return notes


def _drift(log: LoopLog, spectrum: SliderSpectrum) -> Iterator[str]:
    """Loops that do not close: what the sliders leave moves from cycle to cycle."""
    left = log.force - spectrum.force(log)
    turns = log.reversals[1:-1:2]
    means = np.array([left[a:b].mean() for a, b in pairwise(turns)])
    if len(means) < 4:
        return
    cycle = np.arange(len(means)) - (len(means) - 1) / 2
    slope = float(cycle @ means / (cycle @ cycle))
    rest = means - means.mean() - slope * cycle
    deviation = float(np.sqrt(rest @ rest / (len(means) - 2) / (cycle @ cycle)))
    if abs(slope) > SURE * deviation and abs(slope) * len(means) > OPEN * np.ptp(log.force):
        yield (
            f"The loops of {log.name} do not close: their force drifts by {slope * len(means):.3g} N over {len(means)} "
            "cycles, which no law of the way does. Take the drift of the load cell off the column, or cut the log."
        )


def _backlash(log: LoopLog) -> Iterator[str]:
    """A play before the sliders, with which these leave less than half."""
    rough = replace(log.part(0, None, max(len(log.way) // ROUGHLY, 1)), time=None)
    alone = fit_sliders([rough]).left(rough)
    if alone < POOR:
        return

    def left(width: float) -> float:
        bound = np.array([width])
        taken = stops(rough, bound, saturated(rough, bound))[:, 0]
        behind = replace(rough, way=rough.way - taken)
        return fit_sliders([behind]).left(behind)

    from scipy.optimize import minimize_scalar

    widths = np.geomspace(log.range / 200, log.range / 3, PLAYS)
    best = min(range(1, PLAYS - 1), key=lambda i: left(float(widths[i])))
    found: Any = minimize_scalar(left, bounds=(widths[best - 1], widths[best + 1]), method="bounded")
    if found.fun < 0.5 * alone:
        yield (
            f"{log.name} shows a backlash of about {2 * found.x:.2g} m, which sliders do not have: they leave "
            f"{100 * alone:.2g} % of the force, behind a play {100 * found.fun:.2g} %. Fit a law behind a play: --laws "
            "Play-MaxwellSlip-2,Play-Dahl."
        )
