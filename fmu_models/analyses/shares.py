"""Basins over a parameter: which share of the starts in a box comes to which attractor, and where attractors end.

    seeds   at each value the points of all attractors of the value before are starts too, beside those at random
    names   an attractor is the one that the points of the old one come to: one to one keeps the name, through flips and
            into chaos; of several that come to one those that are as near to it merge, the others are lost to it. What
            is lost is remembered for a few values
    tips    where one is lost, merges or is born, between two values, is bisected by where its points come to, always
            from the last ones that did; where it repeats itself a fold on its branch that lies there says it exactly

A share is of so many independent starts, with Wilson's interval.

Source: Datseris, Luiz Rossi, Wagemakers, Framework for global stability analysis of dynamical systems, Chaos 33 (2023).
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fmu_models.analyses.bifurcation import find_bifurcations
from fmu_models.analyses.clouds import HELD, Cloud
from fmu_models.analyses.declaration import NO_BOX, VALUES, WATCHED, Analysis, Box, Option
from fmu_models.analyses.labels import UNLABELLED, Attractor, Labeller, watched
from fmu_models.analyses.unforced import LONGEST, MOST, LimitCycle, Most
from fmu_models.base.arrays import Integers, Vector
from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Pictured
from fmu_models.families.execution import IN_MEMORY, Execution, Runner
from fmu_models.families.store import PROVENANCE, told
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.periodic import find_cycles
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.subject import Subject
from fmu_models.sections.system import SectionSystem, ascending, listed

if TYPE_CHECKING:
    import pandas
    import xarray

SEEDS, FEW = 8, 2  # points of an attractor that are starts at the next value, and near a tipping point
FIRST = 8  # starts at random that look for attractors before the others are run
REMEMBERED = 3  # values for which a lost attractor is looked for
AS_NEAR = 4.0  # times the distance of the nearest of several attractors that come to one: those merge
REFINED = 1e-8  # of the range of the parameter: a tipping point is bisected to that
BESIDE, WITHIN = 1e-2, 1e-4  # of the step between values: where a fold is checked, and how near it is to what it is
PATIENT = 16  # times as long maps, whose steps cost little, are run near a tipping point: transients are long there
CONFIDENT = 1.959963984540054  # normal quantile of 95 %
BORN, LOST, MERGED = "born", "lost", "merged"


@dataclass(frozen=True)
class Tip:
    """Where an attractor begins or ends.

    Attributes:
        kind: "born", "lost" or "merged".
        name: number of the attractor.
        into: number of that which its points come to beyond; -1 where they come to none.
        low, high: values of the parameter between which it lies.
        fold: whether it is a fold of a periodic motion, solved for.
    """

    kind: str
    name: int
    into: int
    low: float
    high: float
    fold: bool = False

    @property
    def value(self) -> float:
        """The middle."""
        return 0.5 * (self.low + self.high)


@dataclass(frozen=True, eq=False)
class BasinShares(Pictured):
    """Of m values and k attractors.

    Attributes:
        model, over: names of the model and the parameter.
        values: (m,) of the parameter.
        starts: at each value.
        counts: (m, k + 3) of the starts that come to each attractor, that go to infinity, are undecided, or failed.
        words: (m, k) what the attractors are there; empty where they are not.
        tips: where attractors begin and end.
        units: of the parameter.
        provenance: see ``Execution``.
    """

    RECORD: ClassVar = ("model", "over", "values", "starts", "names", "shares", "low", "high", "words", "tips")

    model: str
    over: str
    values: Vector
    starts: int
    counts: Integers
    words: tuple[tuple[str, ...], ...]
    tips: tuple[Tip, ...]
    units: Mapping[str, str] = field(default_factory=dict)
    how: str = ""
    provenance: Mapping[str, Any] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Of the columns of ``counts``."""
        return [*(str(k) for k in range(self.counts.shape[1] - len(UNLABELLED))), *UNLABELLED.values()]

    @property
    def shares(self) -> Vector:
        """(m, k + 3) of the starts."""
        return self.counts / self.starts

    @property
    def low(self) -> Vector:
        """(m, k + 3) lower ends of 95 % intervals."""
        return self._wilson[0]

    @property
    def high(self) -> Vector:
        """(m, k + 3) their upper ends."""
        return self._wilson[1]

    @property
    def _wilson(self) -> tuple[Vector, Vector]:
        z2, n, p = CONFIDENT**2, self.starts, self.shares
        middle = (p + z2 / (2 * n)) / (1 + z2 / n)
        half = CONFIDENT * np.sqrt(p * (1 - p) / n + z2 / (4 * n**2)) / (1 + z2 / n)
        return np.where(p > 0.0, np.maximum(middle - half, 0.0), 0.0), np.where(p < 1.0, middle + half, 1.0)

    @property
    def frame(self) -> "pandas.DataFrame":
        """One row per value and attractor that is there, or else what starts come to."""
        import pandas

        there = np.array([[*map(bool, row), *[False] * len(UNLABELLED)] for row in self.words])
        i, k = np.nonzero(there | (self.counts > 0))
        words = [self.words[a][b] if b < len(self.words[a]) else "" for a, b in zip(i, k, strict=True)]
        columns = {self.over: self.values[i], "attractor": np.array(self.names)[k], "what": words}
        columns |= {"share": self.shares[i, k], "low": self.low[i, k], "high": self.high[i, k]}
        return pandas.DataFrame(columns)

    def to_xarray(self) -> "xarray.Dataset":
        """The shares with their intervals."""
        import xarray

        axes = (self.over, "attractor")
        data = {name: (axes, getattr(self, of)) for name, of in (("share", "shares"), ("low", "low"), ("high", "high"))}
        index = {self.over: self.values, "attractor": np.array(self.names, object)}
        return xarray.Dataset(data, index, {"model": self.model, PROVENANCE: told(self.provenance)})

    def _heading(self) -> str:
        count = len(self.names) - len(UNLABELLED)
        labels = f"{count} attractor{'s' if count != 1 else ''}"
        return f"Basins of {self.model} over {self.over}: {len(self.values)} values, {labels}"

    def _contents(self) -> Mapping[str, Any]:
        ends = {
            f"{self.over} = {tip.value:.9g}": f"{tip.name} {tip.kind}" + (f", {tip.into}" if tip.into >= 0 else "")
            for tip in self.tips
        }
        return {self.over: self.values, "starts": self.starts, **ends, "how": self.how or None}


@dataclass(frozen=True)
class _Known:
    """An attractor of the value before. seeds: (k, n) points; seen: the number of the value that it was last seen at;
    repeats: whether the seeds are all points of a motion."""

    name: int
    word: str
    seeds: list[list[float]]
    seen: int
    repeats: bool


def basin_shares(
    system: Subject,
    over: str,
    values: Sequence[float] | Vector,
    *,
    box: Annotated[Box, Option("Range of a state that starts are drawn from.")] = NO_BOX,
    start: Mapping[str, float] | None = None,
    starts: Annotated[int, Option("Starts at each value.", minimum=1)] = 100,
    seed: Annotated[int, Option("Of the starts at random.", minimum=0)] = 0,
    most: Most = MOST,
    longest: int = LONGEST,
    execution: Execution = IN_MEMORY,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> BasinShares:
    """Show shares of basins over a parameter, with intervals, and where attractors are born, merge and are lost.

    Args:
        system: a map, an oscillator at a section, or a model as it is, where nothing forces it.
        over, values: name of a parameter and its values (m,), one after the other.
        box: least and largest value by state.
        start: of the states that are not in the box.
        starts: at each value, evenly in the box, others at each.
        seed: of these.
        most, longest: of ``basins``.
        execution: Who makes the runs, and where what was found at each value is kept.
        progress: called with the fraction done.

    Raises:
        StickslipError: unknown names, values out of range, a box without extent; as ``Runner``.
    """
    system = watched(system)
    swept = listed(over, values)
    system.check(over, swept)
    corners = corners_of(system, box, start)
    plan: dict[str, Any] = {"analysis": "shares", "over": over, "values": swept, "starts": starts, "seed": seed}
    plan |= {"box": dict(box), "start": system.start(start), "most": most, "longest": longest}
    with Runner(system, plan, execution) as runner:
        sweep = _Sweep(runner, system, over, swept, most, longest)
        sweep.run(corners, starts, seed, progress)
        return runner.finish(sweep.result(starts))


def corners_of(system: SectionSystem, box: Box, start: Mapping[str, float] | Sequence[float] | None = None) -> Vector:
    """(2, n) the points between which a box of states lies, of a start where it says nothing.

    Raises:
        StickslipError: an unknown state, a box without extent, values out of range.
    """
    if not box:
        raise StickslipError(f"Say where starts of {system.name} are drawn from: a range for a state, as x=-1:1.")
    corners = np.tile(system.start(start), (2, 1))
    for name, ends in box.items():
        refuse_unknown(name, system.states, f"'{system.name}' has no state '{name}'.")
        for end in ascending(name, ends):
            system.start({name: end})
        corners[:, system.states.index(name)] = ends
    return corners


class _Sweep:
    """The values one after the other.

    Attributes:
        counts: by value, of starts by name of their attractor, or label where they come to none.
        words: by value, what the attractors are by name.
        tips: so far.
        known: attractors by name, remembered ones too.
    """

    def __init__(
        self, runner: Runner, system: SectionSystem, over: str, values: Vector, most: int, longest: int
    ) -> None:
        self.runner, self.system, self.over, self.values = runner, system, over, values
        self.most, self.longest = most, longest
        self.counts: list[dict[int, int]] = []
        self.words: list[dict[int, str]] = []
        self.tips: list[Tip] = []
        self.known: dict[int, _Known] = {}
        self.names = 0

    def run(self, corners: Vector, starts: int, seed: int, progress: Callable[[float], Any]) -> None:
        """All values; those that a store has are read."""
        chain = self.runner.store.chain() if self.runner.store else None
        for i in range(len(self.values)):
            if chain is not None and i < len(chain.texts):
                self._read(json.loads(chain.texts[i]))
            else:
                points = np.random.default_rng([seed, i]).uniform(corners[0], corners[1], (starts, corners.shape[1]))
                self._at(i, points)
                if chain is not None:
                    chain.put(json.dumps(self._written()))
            progress((i + 1) / len(self.values))

    def _written(self) -> dict[str, Any]:
        known = [asdict(attractor) for attractor in self.known.values()]
        last = {"counts": [*self.counts[-1].items()], "words": [*self.words[-1].items()], "names": self.names}
        return {**last, "tips": [asdict(tip) for tip in self.tips], "known": known}

    def _read(self, content: Mapping[str, Any]) -> None:
        self.counts.append({int(name): count for name, count in content["counts"]})
        self.words.append({int(name): word for name, word in content["words"]})
        self.tips = [Tip(**tip) for tip in content["tips"]]
        self.known = {attractor["name"]: _Known(**attractor) for attractor in content["known"]}
        self.names = content["names"]

    def _labeller(self, value: float, patient: int = 1, *, verdicts: bool = True) -> Labeller:
        values, how = {self.over: value}, {"verdicts": verdicts, "lasting": False}
        runner, system = self.runner.holding(**values), self.system.at(**values)
        return Labeller(runner, system, patient * self.most, self.longest, **how)

    def _at(self, i: int, points: Vector) -> None:
        """One value, with starts (m, n) at random."""
        labeller = self._labeller(float(self.values[i]))
        before = self.known
        names, ends = self._matched(labeller, [a for a in before.values() if i - a.seen <= REMEMBERED], i - 1)
        back = {name for name in names.values() if before[name].seen < i - 1}  # at the very value of a flip or a fork
        self.tips = [tip for tip in self.tips if tip.name not in back or tip.into >= 0]
        labels = np.concatenate([labeller.label(part).labels for part in (points[:FIRST], points[FIRST:]) if len(part)])
        for label in range(len(labeller.attractors)):
            if label not in names:
                names[label] = self.names
                self.names += 1
                if i > 0:
                    ends.append((BORN, names[label], -1))
        present = {names[k]: self._seeded(names[k], a, i) for k, a in enumerate(labeller.attractors)}
        self.known = {**before, **present}
        counted = zip(*np.unique(labels, return_counts=True), strict=True)
        self.counts.append({names.get(int(label), int(label)): int(count) for label, count in counted})
        self.words.append({names[k]: attractor.word for k, attractor in enumerate(labeller.attractors)})
        self.tips += [tip for end in ends for tip in self._refined(end, i, before)]

    def _seeded(self, name: int, attractor: Attractor, i: int) -> _Known:
        points = attractor.points
        chosen = points[np.unique(np.linspace(0, len(points) - 1, SEEDS).astype(int))]
        repeats = not isinstance(attractor, Cloud | LimitCycle) and len(points) <= SEEDS
        return _Known(name, attractor.word, chosen.tolist(), i, repeats)

    def _matched(
        self, labeller: Labeller, known: Sequence[_Known], last: int
    ) -> tuple[dict[int, int], list[tuple[str, int, int]]]:
        """Names of the attractors that old ones come to, by label, and what became of the others: kind, name, into."""
        if not known:
            return {}, []
        seeds = [np.array(attractor.seeds) for attractor in known]
        labels = np.split(labeller.label(np.concatenate(seeds)).labels, np.cumsum([len(s) for s in seeds])[:-1])
        names: dict[int, int] = {}
        ends: list[tuple[str, int, int]] = []
        reached = [_most_frequent(label) for label in labels]
        for k, attractor in enumerate(labeller.attractors):
            coming = [j for j, label in enumerate(reached) if label == k]
            coming = [j for j in coming if known[j].seen == last] or coming
            if not coming:
                continue
            distances = np.array([self._distance(seeds[j], attractor) for j in coming])
            near = [j for j, d in zip(coming, distances, strict=True) if d <= AS_NEAR * distances.min()]
            name = names[k] = min(known[j].name for j in near)
            for j in coming:
                if known[j].name != name and known[j].seen == last:
                    ends.append((MERGED if j in near else LOST, known[j].name, name))
        gone = [known[j].name for j, label in enumerate(reached) if label < 0 and known[j].seen == last]
        return names, [*ends, *((LOST, name, -1) for name in gone)]

    def _distance(self, seeds: Vector, attractor: Attractor) -> float:
        """Of the points of an old attractor from one: 0 where they lie in its cells."""
        if isinstance(attractor, Cloud) and attractor.share(seeds) >= HELD:
            return 0.0
        sizes = self.system.sizes()
        differences = self.system.difference(seeds[:, None] - attractor.points[None]) / sizes
        return float(np.abs(differences).max(axis=2).min(axis=1).mean())

    def _refined(self, end: tuple[str, int, int], i: int, before: Mapping[int, _Known]) -> Iterator[Tip]:
        """Where an attractor begins or ends between two values, nearly; none where it was there from the first on."""
        kind, name, into = end
        alive, gone = (i, i - 1) if kind == BORN else (i - 1, i)
        # at first those of the value where it is there
        last = [a for a in (self.known if kind == BORN else before).values() if a.seen == alive]
        while kind == BORN and (lives := self._lives(name, last, float(self.values[gone]))):
            if gone == 0:
                return
            alive, gone, last = gone, gone - 1, lives  # it was there, and no start had come to it
        high, low = float(self.values[gone]), float(self.values[alive])  # where it is not, and where it is
        step = high - low
        folds = self._folds(next(a for a in last if a.name == name), low, high)
        for fold in folds:
            if self._lives(name, last, fold - BESIDE * step) and not self._lives(name, last, fold + BESIDE * step):
                yield Tip(kind, name, into, fold, fold, fold=True)
                return
        while abs(high - low) > REFINED * float(np.ptp(self.values)):
            middle = 0.5 * (low + high)
            if middle in (low, high):
                break
            lives = self._lives(name, last, middle)
            low, high, last = (middle, high, lives) if lives else (low, middle, last)
        solved = [fold for fold in folds if abs(fold - low) < WITHIN * abs(step)]
        yield Tip(kind, name, into, *(solved[:1] * 2 or sorted((low, high))), fold=bool(solved))

    def _lives(self, name: int, known: Sequence[_Known], value: float) -> list[_Known]:
        """The attractors at a value that is between, if one of that name is still among them; else none."""
        patient = PATIENT if isinstance(self.system, Iteration) else 1
        labeller = self._labeller(value, patient, verdicts=False)
        # of the others a few points say whether they come to the same
        few = [a if a.name == name else replace(a, seeds=a.seeds[:FEW]) for a in known]
        names, _ = self._matched(labeller, few, known[0].seen)
        if name not in names.values():
            return []
        return [self._seeded(names[k], a, known[0].seen) for k, a in enumerate(labeller.attractors) if k in names]

    def _folds(self, attractor: _Known, low: float, high: float) -> list[float]:
        """Values at which the branch of a motion folds between two; none of what does not repeat itself."""
        if not attractor.repeats or self.system.autonomous or not isinstance(self.system, Iteration | Strobe):
            return []
        with suppress(StickslipError):
            cycles = find_cycles(self.system.at(**{self.over: low}), np.array([attractor.seeds]))
            met = find_bifurcations(self.system, self.over, (low, high), cycles)
            return [bifurcation.value for bifurcation in met if bifurcation.kind == "saddle-node"]
        return []

    def result(self, starts: int) -> BasinShares:
        """All of it."""
        columns = [*range(self.names), *UNLABELLED]
        counts: NDArray[np.int64] = np.array([[row.get(column, 0) for column in columns] for row in self.counts])
        words = tuple(tuple(row.get(name, "") for name in range(self.names)) for row in self.words)
        names = self.system.name, self.over, self.values, starts, counts, words, tuple(self.tips)
        units = self.system.units(self.over)
        return BasinShares(*names, units, self.system.how, self.runner.provenance)


def _most_frequent(labels: Integers) -> int:
    """The label of an attractor that most of them are; else any."""
    known = labels[labels >= 0]
    return int(np.bincount(known).argmax()) if known.size else int(labels[0])


def _numbers(result: BasinShares) -> list[tuple[float, dict[str, float]]]:
    tips = {f"{tip.kind}_{tip.name}": tip.value for tip in result.tips}
    rows = []
    for i, value in enumerate(result.values.tolist()):
        shares = {f"share_{name}": float(result.shares[i, k]) for k, name in enumerate(result.names)}
        rows.append((value, {**shares, **(tips if i == 0 else {})}))
    return rows


ANALYSIS = Analysis(
    function=basin_shares,
    numbers=_numbers,
    results=(
        "a row per value: `share_0`, of the starts that come to the first attractor, and so on; the first row has "
        "where attractors begin and end too: `born_1`, `merged_1`, `lost_0`"
    ),
    example="discontinuous_support --forcing omega --set ks=10 --over omega=1:1.3:31 --box x=-8:8 --box v=-8:8",
    label="shares",
    axes=VALUES,
    without=WATCHED,
    page=False,
)
