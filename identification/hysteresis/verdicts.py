"""What loops of force over displacement leave open, and what in them no law of the way can be."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np

from identification.hysteresis.loop import LoopLog, saturated, scatter, stops
from identification.hysteresis.read import ROUGHLY
from identification.hysteresis.spectrum import SliderSpectrum, fit_sliders

PLAYS = 24  # widths of a backlash that are tried
POOR = 0.05  # of the force: what sliders leave at least where a backlash is looked for
OPEN = 0.02  # of the range of the force: a drift that is said
STIFF = 0.2  # of the stiffness: what rises at once that is said
LEFT, NOISES = 0.005, 2.0  # of the force, of its noise: what sliders leave at least where more is looked for
TELLS = 0.6  # of what is left: what a cause leaves at most
NEARLY = 1.1  # times the least of it: a simpler cause is named
SURE = 4.0  # standard deviations of it
WEAKENED = 0.15  # of the force, from the first cycle to the last: a trend that is said
ALONG = 0.1  # of a trend over the cycles: what their amplitudes must leave of it
UNTOLD = 0.1  # of the force: what sliders leave at least where something else is asked for


def verdicts(
    logs: Sequence[LoopLog], spectrum: SliderSpectrum, varied: bool, least: Mapping[str, float] = MappingProxyType({})
) -> list[str]:
    """What the logs leave open, in sentences; ``varied``: the sliders grow with conditions; ``least``: by log, what the
    best law leaves of the force."""
    notes = []
    if spectrum.is_rigid():
        notes.append(
            f"The stiffness is not determined: it is larger than {spectrum.stiffness_at_rest():.3g} N/m, for the force "
            f"has risen where the way has gone {spectrum.bound.min():.2g} m."
        )
    elif spectrum.slides.any() and (k := spectrum.at()[spectrum.slides])[spectrum.at_once].sum() > STIFF * k.sum():
        slow, force = k[~spectrum.at_once].sum(), (k * spectrum.bound[spectrum.slides])[spectrum.at_once].sum()
        notes.append(
            f"The sliders do not determine the stiffness: {force:.3g} N rise at once as the way turns, as by dry "
            "friction, damping by speed, a force that leads, or a law of another kind; without them it is "
            f"{slow:.3g} N/m. Give the time, slower loops, or compare with the laws."
        )
    if not spectrum.slides.any() or spectrum.sliding_force() == 0:
        notes.append("Nothing gives way within these loops: a spring tells all that they show.")
    if spectrum.spring_beside() < -0.05 * spectrum.stiffness_at_rest():
        notes.append("The spring beside the sliders is negative: a force that falls with the way, which no slider has.")
    for log in logs:
        remarks = [*_drift(log, spectrum), *(() if log.signals else _backlash(log))]
        if not remarks and least.get(log.name, np.inf) > TELLS * spectrum.left(log):
            remarks += _beside(log, spectrum)
        if not remarks and (left := spectrum.left(log)) > UNTOLD:
            remarks = [
                f"Sliders leave {100 * left:.3g} % of the force of {log.name}: it depends on more than its way. On the "
                "speed (a column of the time), on what a column or the file's name tells (--factors), on a clearance "
                "without force, on damage (--laws BoucWenBaberNoori)? Look at the loops: --figure FILE.png."
            ]
        notes += remarks
        if log.load is None or (left := spectrum.left(log)) == 0:
            continue
        ignored = replace(log, load=None)
        without = fit_sliders([ignored], rate=spectrum.rate).left(ignored)
        notes.append(
            f"The force of {log.name} is taken in proportion to its load: {100 * left:.3g} % are left of "
            f"it, {100 * without:.3g} % where the load is ignored."
            + (" Leave it out: --column load=" if without < 0.9 * left else "")
        )
    if varied:
        notes.append("Laws are fitted to logs of one condition: name these alone, without factors.")
    return notes


def _drift(log: LoopLog, spectrum: SliderSpectrum) -> Iterator[str]:
    """Loops that do not close, or lose their height: what the sliders leave moves from cycle to cycle."""
    model = spectrum.force(log)
    cycles = [slice(a, b) for a, b in pairwise(log.reversals[1:-1:2])]
    if len(cycles) < 4:
        return
    spans = [float(np.ptp(log.way[cycle])) for cycle in cycles]
    moved = _trend([float(np.mean(log.force[cycle] - model[cycle])) for cycle in cycles], [])
    if abs(moved) > OPEN * np.ptp(log.force):
        yield (
            f"The loops of {log.name} do not close: their force drifts by {moved:.3g} N over {len(cycles)} "
            "cycles, which no law of the way does. Take the drift of the load cell off the column, or cut the log."
        )
    pairs = [(log.force[cycle] - log.force[cycle].mean(), model[cycle] - model[cycle].mean()) for cycle in cycles]
    # sliders may err by the amplitude alike, so that only what cycles of one amplitude lose counts
    gain = _trend([float(f @ m / max(m @ m, 1e-300)) for f, m in pairs], spans)
    if abs(gain) > WEAKENED:
        yield (
            f"The force of {log.name} {'grows' if gain > 0 else 'weakens'} by {100 * abs(gain):.2g} % over "
            f"{len(cycles)} cycles beside what their amplitudes make, which no law without damage does. Fit one that "
            "has it, --laws BoucWenBaberNoori, or cut the log."
        )


def _trend(values: Sequence[float], spans: Sequence[float]) -> float:
    """How far values of cycles go from the first to the last, along a straight line beside one of their ``spans`` where
    these differ; 0 where that is not sure."""
    cycle = np.arange(len(values)) - (len(values) - 1) / 2
    others = [np.ones(len(values)), *([np.asarray(spans)] if np.ptp(spans or [0.0]) > 0 else [])]
    basis = np.linalg.qr(np.column_stack(others))[0]
    along, rest = (series - basis @ (basis.T @ series) for series in (cycle, np.asarray(values)))
    if len(values) < len(others) + 3 or along @ along < ALONG * (cycle @ cycle):
        return 0.0
    slope = float(along @ rest / (along @ along))
    rest = rest - slope * along
    deviation = float(np.sqrt(rest @ rest / (len(values) - len(others) - 1) / (along @ along)))
    return slope * len(values) if abs(slope) > SURE * deviation else 0.0


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


def _beside(log: LoopLog, spectrum: SliderSpectrum) -> Iterator[str]:
    """What the sliders leave, where one cause that is none of theirs tells most of it."""
    acting, columns = spectrum.acting(log)
    explained = np.column_stack([columns, log.way, np.ones(len(log.way))])
    size = float(np.std(log.force))

    def left(more: np.ndarray) -> tuple[float, np.ndarray]:
        every = np.column_stack([explained, more])
        lengths = np.linalg.norm(every, axis=0)
        lengths[lengths == 0] = 1.0
        weights = np.linalg.lstsq(every / lengths, log.force, rcond=1e-9)[0] / lengths
        return float(np.std(log.force - every @ weights)) / size, weights[explained.shape[1] :]

    alone, noise = left(np.zeros((len(log.way), 0)))[0], scatter(log.force) / size
    if alone < max(LEFT, NOISES * noise) or size == 0 or not len(acting):
        return
    away, gone = log.way - log.center, np.cumsum(np.abs(np.diff(log.way, prepend=log.way[0])))
    ends = log.reversals[1:-1:2]
    cycle = np.searchsorted(ends, np.arange(len(log.way)), side="right")
    step = 1.0 if log.time is None else float(np.median(np.diff(log.time)))
    unit = "samples" if log.time is None else "s"
    causes: list[tuple[np.ndarray, Callable[[np.ndarray], str]]] = [
        (
            acting * (gone / gone[-1] - 0.5),
            lambda w: f"changes by {100 * w[0]:+.2g} % over the log, as by wear or warming",
        ),
        (np.gradient(acting) / step, lambda w: f"comes about {-w[0]:.2g} {unit} after its way, as through a filter"),
        (np.abs(acting), lambda w: f"is {200 * w[0]:+.2g} % larger on the positive side than on the negative"),
        (away**3, lambda w: f"has a spring beside that {'stiffens' if w[0] > 0 else 'softens'} with the way"),
        (np.eye(len(ends) + 1)[cycle] * acting[:, None], lambda w: f"of its cycles differs by {100 * np.ptp(w):.2g} %"),
    ]
    effects = [(*left(more), said) for more, said in causes]
    best = min(share for share, _, _ in effects)
    if best < TELLS * alone:
        share, weights, said = next(one for one in effects if one[0] < NEARLY * best)
        yield (
            f"Sliders leave {100 * alone:.2g} % of the force of {log.name}, its noise alone {100 * noise:.2g} %. "
            f"Of it {100 * share:.2g} % are left where the force {said(weights)}: no law here has "
            "that, and no interval."
        )
