"""Rate-induced tipping: an input that moves from one value to another, and what the motion comes to, by the rate.

    begin   the attractor that the start comes to where the input has its first value
    move    the input goes along a straight line to its last value, at a rate; a forced motion goes on to a whole period
    told    which attractor of the last value the motion comes to; rates from slow to fast, evenly in their logarithm
    tips    between two rates whose motions come to different ones the rate is bisected; there the motion ends on the
            border of two basins, which is followed to its edge state (``edge``)

The slowest rate tells what the attractor becomes if the input creeps. A pair of tips between two rates is not seen.

Source: Ashwin, Wieczorek, Vitolo, Cox, Tipping points in open systems: bifurcation, noise-induced and rate-dependent
examples in the climate system, Philosophical Transactions of the Royal Society A 370 (2012).
"""

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np

from fmu_models.analyses.attractors import UNDECIDED
from fmu_models.analyses.declaration import NO_RAMP, WATCHED, Analysis, Box, Option
from fmu_models.analyses.edge import LABELS, NOWHERE, Border
from fmu_models.analyses.labels import FAILED, INFINITE, Attractor, Labeller, watched
from fmu_models.analyses.unforced import LONGEST, MOST, SAME, LimitCycle, Most
from fmu_models.base.arrays import Integers, Vector
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Pictured
from fmu_models.families.execution import Runner
from fmu_models.sections.periodic import PeriodicMotion
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.subject import Subject
from fmu_models.simulation.run import simulate

SLOWEST, FASTEST = 1e3, 1e-2  # durations, in steps of the strobe
GONE = (INFINITE, FAILED)
EXACT = 1e-12  # relative distance to which a rate is bisected


@dataclass(frozen=True)
class TippingRate:
    """A rate at which the motion changes sides.

    Attributes:
        low, high: rates between which it lies.
        slower, faster: what the motion comes to on both sides, in words.
        edge: what it comes to at that rate: the edge state of the border, in words.
    """

    low: float
    high: float
    slower: str
    faster: str
    edge: str

    @property
    def value(self) -> float:
        """The middle."""
        return 0.5 * (self.low + self.high)


@dataclass(frozen=True, eq=False)
class TippingRates(Pictured):
    """What a motion comes to while an input moves, over the rate.

    Attributes:
        model, over: names of the model and the input.
        first, last: values of the input.
        comes_from: what the motion was, in words.
        rates: (m,) of the input.
        labels: (m,) numbers of what it comes to; those of attractors count from 0.
        words: (m,) what that is.
        tips: where it changes.
        failures: why a motion could not be continued while the input moved, by the number of the rate.
        units: of the input.
        how: of ``SectionSystem``.
    """

    COLUMNS: ClassVar = ("rate=rates", "attractor=labels", "what=words")
    RECORD: ClassVar = ("model", "over", "first", "last", "comes_from", "rates", "labels", "words", "tips", "how")

    model: str
    over: str
    first: float
    last: float
    comes_from: str
    rates: Vector
    labels: Integers
    words: tuple[str, ...]
    tips: tuple[TippingRate, ...]
    failures: Mapping[int, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    how: str = ""

    def _heading(self) -> str:
        return f"Tipping of {self.model} from {self.comes_from}, {self.over} from {self.first:g} to {self.last:g}"

    def _contents(self) -> Mapping[str, Any]:
        tips = {f"rate {tip.value:.12g}": f"{tip.slower} | {tip.faster}, at it {tip.edge}" for tip in self.tips}
        return {"slowest": self.words[0], **tips, "fastest": self.words[-1], "how": self.how or None}


def tipping_rates(
    system: Subject,
    start: Mapping[str, float] | None = None,
    *,
    ramp: Annotated[Box, Option("Input that moves, and its first and last value.")] = NO_RAMP,
    slowest: Annotated[float, Option("Least rate; 0: over 1000 times in which the motion changes.")] = 0.0,
    fastest: Annotated[float, Option("Largest rate; 0: over 1/100 of that time.")] = 0.0,
    rates: Annotated[int, Option("How many rates are tried.", minimum=2)] = 26,
    most: Most = MOST,
    longest: int = LONGEST,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> TippingRates:
    """Find the rates of an input at which a motion tips into another basin.

    Args:
        system: a model as it is, where nothing forces it, or its strobe.
        start: comes to the attractor that the motion is on when the input begins to move: at the start itself, where
            that lies on the cycle of a motion which nothing forces, else at the attractor's first point.
        ramp: the first and the last value of one input, by its name.
        slowest, fastest: rates, in the unit of the input by s; 0 where the motion's own time says them.
        rates: between these, ends included.
        most, longest: of ``basins``.
        progress: called with the fraction done.

    Raises:
        StickslipError: a map or another section, no input of that name, values that are equal or out of their range,
            rates that are not positive and ascending, a start that comes to no attractor.
    """
    system = watched(system)
    if not isinstance(system, Strobe):
        raise StickslipError(f"{system.name}: an input moves with time, so that the model or its strobe is needed.")
    if len(ramp) != 1:
        raise StickslipError(f"One input moves: give its name, first and last value, as u=0:3; found {len(ramp)}.")
    ((over, (first, last)),) = ramp.items()
    what = f"'{system.name}' has no input '{over}', and parameters do not move: declare it as an Input."
    refuse_unknown(over, system.fmu.inputs, what)
    system.check(over, np.array([first, last]))
    step, way = float(system.periods({}, 1)[0]) * system.every, abs(last - first)
    least, largest = slowest or way / (SLOWEST * step), fastest or way / (FASTEST * step)
    if not (way > 0.0 and 0.0 < least < largest < math.inf):
        raise StickslipError(f"Rates go from {least:g} to {largest:g}, '{over}' from {first:g} to {last:g}: both must "
                             "ascend, rates above 0, and the two values of the input differ.")  # fmt: skip
    tried = np.geomspace(least, largest, rates)
    with Runner(system) as runner:
        before, after = (
            Labeller(runner.holding(**{over: value}), system.at(**{over: value}), most, longest)
            for value in (first, last)
        )
        begin = system.start(start)
        home = int(before.label(begin[None]).labels[0])
        if home < 0:
            raise StickslipError(
                f"That start of {system.name} comes to no attractor at {over} = {first:g}: it is {before.word(home)}."
            )
        attractor = before.attractors[home]
        point = _phase(attractor, begin)
        moved = _Moved(system, over, (first, last), point, after)
        labels = []
        for k, rate in enumerate(tried.tolist()):
            labels.append(moved.label(rate))
            progress((k + 1) / (len(tried) + 1))
        tips = tuple(moved.tip(*tried[k : k + 2], *labels[k : k + 2]) for k in moved.changes(labels))
    words, units = tuple(after.word(label) for label in labels), system.units(over)
    failures = {k: moved.failures[rate] for k, rate in enumerate(tried.tolist()) if rate in moved.failures}
    names = system.name, over, first, last, attractor.word
    return TippingRates(*names, tried, np.array(labels), words, tips, failures, units, system.how)


def _phase(attractor: Attractor, start: Vector) -> Vector:
    """(n,) where the motion is on its attractor when the input begins to move."""
    if isinstance(attractor, LimitCycle) and attractor.farthest(start, 1) <= SAME:
        return start
    return attractor.points[0] if isinstance(attractor, PeriodicMotion) else start


class _Moved:
    """The motion from a point (n,) while an input moves over its ends.

    Attributes:
        failures: why it could not be continued, by rate.
    """

    def __init__(self, system: Strobe, over: str, ends: tuple[float, float], point: Vector, labeller: Labeller) -> None:
        self.system, self.over, self.ends, self.point, self.labeller = system, over, ends, point, labeller
        self.failures: dict[float, str] = {}

    def end(self, rate: float) -> Vector | None:
        """(n,) where it is when the input stands still; None where it goes to infinity before, or cannot go on."""
        system, (first, last) = self.system, self.ends
        moving = stop = abs(last - first) / rate
        if not system.autonomous:
            period = float(system.periods({}, 1)[0]) * system.every
            stop = period * math.ceil(moving / period)
        run: dict[str, Any] = system.as_run(self.point)
        # one knot too many where both times are one
        signal = np.unique([0.0, moving, stop]), [first, last, last][: 2 + (stop > moving)]
        inputs = {**run.pop("inputs", {}), self.over: signal}
        try:
            motion = simulate(system.fmu, stop, **run, inputs=inputs, output_times=[stop], tolerance=system.tolerance)
        except StickslipError as error:
            self.failures[rate] = str(error)
            return None
        return system.start({name: float(motion[name][-1]) for name in system.fmu.states})

    def label(self, rate: float) -> int:
        """What it comes to after that."""
        end = self.end(rate)
        return FAILED if end is None else int(self.labeller.label(end[None]).labels[0])

    def changes(self, labels: list[int]) -> list[int]:
        """Numbers of the labels whose next one is another, as far as both are known."""
        pairs = enumerate(itertools.pairwise(labels))
        return [k for k, (a, b) in pairs if a != b and UNDECIDED not in (a, b) and not (a in GONE and b in GONE)]

    def tip(self, low: float, high: float, slower: int, faster: int) -> TippingRate:
        """The rate between two at which what it comes to changes."""
        while high - low > EXACT * high:
            middle = 0.5 * (low + high)
            label = self.label(middle)
            if middle in (low, high) or label == UNDECIDED:
                break
            if label == slower:
                low = middle
            else:  # a third one takes the place of the faster
                high, faster = middle, label
        ends, edge = [self.end(rate) for rate in (low, high)], "not decided"
        if slower not in NOWHERE and faster not in NOWHERE and not any(end is None for end in ends):
            labeller = self.labeller
            edge = Border(labeller, np.array(ends), labeller.count + LABELS, sides=(slower, faster)).followed()[0]
        words = self.labeller.word(slower), self.labeller.word(faster)
        return TippingRate(float(low), float(high), *words, edge)


def _numbers(result: TippingRates) -> dict[str, float]:
    tips = {f"rate_{k + 1}": tip.value for k, tip in enumerate(result.tips)}
    return {"tips": float(len(result.tips)), **tips}


ANALYSIS = Analysis(
    function=tipping_rates,
    numbers=_numbers,
    results="`tips`, how many there are, and `rate_1` and so on, where they are",
    example="block_on_belt --ramp v_belt=0.3:0.8 --figure tipping.png",
    label="moving",
    without=WATCHED,
    page=False,
)
