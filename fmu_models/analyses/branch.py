"""The branch of a periodic motion, with what leaves it, and curves of what is special on it."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from fmu_models.analyses.attractors import claimed
from fmu_models.analyses.declaration import (
    CROSSED,
    NO_BOX,
    NO_NUMBERS,
    RANGE,
    SHOWN,
    Analysis,
    Box,
    Numbers,
    Option,
    Range,
)
from fmu_models.analyses.shares import corners_of
from fmu_models.analyses.unforced import at_its_cycle
from fmu_models.base.arrays import Vector
from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import Spanned
from fmu_models.base.formula import Formula
from fmu_models.base.shown import Pictured
from fmu_models.continuation.branch import MULTIPLIER, PERIOD
from fmu_models.continuation.branches import Branches, branches, measuring
from fmu_models.continuation.curves.curve import Curve, Curves, closed_form_of
from fmu_models.continuation.equilibrium_branch import EquilibriumBranch
from fmu_models.continuation.overlay import Motion, follow_motions
from fmu_models.families.execution import IN_MEMORY, Execution
from fmu_models.families.jobs import Jobs
from fmu_models.sections.amounts import shown_of
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.strobe import Strobe
from fmu_models.sections.system import SectionSystem

if TYPE_CHECKING:
    import pandas
    import xarray

PLACES, STARTS, TRANSIENT = 9, 32, 500  # with a box: values of the parameter, starts at each, steps they settle in


@dataclass(frozen=True, eq=False)
class Followed(Pictured):
    """What was followed over a parameter.

    Attributes:
        branch: Motions or equilibria, and what is special among them.
        curves: The special points as curves in a second parameter, where these were asked for. Then they are shown.
    """

    branch: Branches | EquilibriumBranch
    curves: Curves | None = None

    @property
    def shown(self) -> Branches | EquilibriumBranch | Curves:
        """What a picture and a table show."""
        return self.curves or self.branch

    @property
    def interrupted(self) -> bool:
        """Whether the keyboard ended it early."""
        curves = self.curves.curves if self.curves else ()
        return self.branch.interrupted or any(curve.interrupted for curve in curves)

    @property
    def how(self) -> str:
        """Where rates and steps come from; see ``SectionSystem.how``."""
        return "" if self.curves else self.branch.how

    @property
    def spanned(self) -> Spanned | None:
        """As what is shown."""
        return self.shown.spanned

    @property
    def frame(self) -> "pandas.DataFrame":
        """One row per point."""
        return self.shown.frame

    def to_xarray(self) -> "xarray.Dataset":
        """The points as a data set."""
        return self.shown.to_xarray()

    def record(self) -> dict[str, Any]:
        """Everything as JSON."""
        content = {**self.branch.record(), "not_followed": list(self.curves.failures) if self.curves else []}
        if self.curves or self.interrupted:
            content["curves"] = [self._curve(curve) for curve in self.curves.curves] if self.curves else []
        return content

    def _curve(self, curve: Curve) -> dict[str, Any]:
        form = self.curves.closed_form if self.curves else None
        error = np.nan if form is None else form.error(curve)
        return {**curve.record(), "from_closed_form": error if np.isfinite(error) else None}

    def _heading(self) -> str:
        return self.shown._heading()

    def _contents(self) -> Mapping[str, Any]:
        return self.shown._contents()


def follow_branch(
    system: SectionSystem,
    over: str,
    between: tuple[float, float],
    *,
    start: Mapping[str, float] | Sequence[float] | None = None,
    settle: Annotated[bool, Option("Run to a motion from the start first.", in_scene=True)] = False,
    switch: Annotated[
        bool, Option("Branches that leave the first one to follow too: none, all.", words=("none", "all"))
    ] = False,
    longest: Annotated[int, Option("With --switch all: period, in those of the forcing.", minimum=1)] = 8,
    curve: Annotated[Range | None, Option("Each special point as a curve in this parameter too.")] = None,
    closed_form: Annotated[
        str | None,
        Option(
            "What is drawn as it is known, by the parameter; with --curve: NAME of one.",
            metavar="FORMULA",
            constants="constants",
        ),
    ] = None,
    points: Annotated[int, Option("Motions in each direction, at most.", minimum=2)] = 2000,
    of: Annotated[str | None, Option(SHOWN, default="the first state", metavar="WHAT")] = None,
    box: Annotated[
        Box, Option("Follow also what starts in this range of a state come to: loops away from the first branch.")
    ] = NO_BOX,
    constants: Numbers = NO_NUMBERS,
    execution: Execution = IN_MEMORY,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> Followed:
    """Follow a periodic motion over a parameter, stable or not, through every bifurcation.

    Args:
        others: as for ``branches``.
        constants: values of names in the closed form, before those that the model has.
        curve: name, least and largest value of a second parameter.
        box: least and largest value of states, at ``PLACES`` values of the parameter, of ``STARTS`` starts that are run
            to where they stay. What repeats itself there within ``longest`` periods is followed where no branch has it.

    Raises:
        StickslipError: a box of what nothing forces, and as ``branches``, ``corners_of`` and ``Branches.curves``.
    """
    corners = corners_of(system, box, start) if box else None
    if corners is not None and (system.autonomous or not isinstance(system, Strobe | Iteration)):
        raise StickslipError("Starts in a box are of a map, or of a strobe of what forces the motion. Leave it out.")
    system, start = at_its_cycle(system, start)
    formula = Formula.read(closed_form) if closed_form else None
    options: dict[str, Any] = {"settle": settle, "points": points, "switch": switch, "longest": longest, "of": of}
    followed = branches(system, over, between, start=start, execution=execution, progress=progress, **options)
    if corners is not None:
        members, amount = list(followed.branches), shown_of(followed.of, system, (MULTIPLIER, PERIOD))
        known = len(members)
        motions = _settled(system, over, between, corners, longest)
        interrupted, _ = follow_motions(system, over, motions, between, longest, members)
        added = measuring(members[known:], amount)
        followed = replace(followed, branches=(*followed.branches, *added), interrupted=interrupted)
    if formula and curve is None:
        form = closed_form_of(followed.branches[0].nodes[0], formula, constants)
        followed = replace(followed, closed_form=form)
    if curve is None or followed.interrupted:
        return Followed(followed)
    curves = followed.curves(curve[0], curve[1:])
    form = closed_form_of(curves.curves[0].nodes[0], formula, constants) if formula else None
    return Followed(followed, replace(curves, closed_form=form))


def _settled(
    system: SectionSystem, over: str, between: tuple[float, float], corners: Vector, longest: int
) -> Iterator[Motion]:
    """The periodic motions that starts between two points come to, over the range of a parameter."""
    values = np.repeat(np.linspace(*between, PLACES), STARTS)
    starts = np.random.default_rng(0).uniform(corners[0], corners[1], (len(values), corners.shape[1]))
    jobs = Jobs(starts, {over: values}, transient=TRANSIENT, rows=2 * longest, longest=longest)
    motions = claimed(system, system.make(jobs), jobs.varied, longest=longest).motions
    for value, motion in zip(values.tolist(), motions, strict=True):
        if motion is not None:
            yield value, motion.period, motion.points[0]


def numbering() -> Callable[[str], str]:
    """From a kind to it as a name with the number of those before and itself: "fold_1"."""
    numbers: Counter[str] = Counter()

    def numbered(kind: str) -> str:
        name = kind.replace(", ", "_").replace(" ", "_")
        numbers[name] += 1
        return f"{name}_{numbers[name]}"

    return numbered


def special_values(specials: Sequence[Any]) -> dict[str, float]:
    """Values of the parameter at special points, by kind and number."""
    numbered = numbering()
    return {numbered(special.kind): special.value for special in specials}


def numbers_at(
    branches: Sequence[Any], values: Sequence[float], name: str, special: Mapping[str, float]
) -> list[tuple[float, dict[str, float]]]:
    """How many points of branches there are at each value, and how many stable ones; first the special points too."""
    rows: list[tuple[float, dict[str, float]]] = []
    for value in values:
        count = stable = 0
        for branch in branches:
            for i in branch.segments_at(value):
                count += 1
                stable += bool(branch.stable[i] and branch.stable[i + 1])
        rows.append((value, {name: float(count), "stable": float(stable), **({} if rows else special)}))
    return rows


def _numbers(followed: Followed, values: Sequence[float]) -> list[tuple[float, dict[str, float]]]:
    branches: Any = followed.branch
    rows = numbers_at(branches.branches, values, "motions", special_values(branches.special))
    for value, numbers in rows:
        told = sorted(tuple(row) for member in branches.branches for row in member.amounts_at(value))
        for k, (amount, slope) in enumerate(told, 1):
            numbers |= {f"{branches.of}_{k}": amount, f"{branches.of}_{k}_slope": slope}
    return rows


ANALYSIS = Analysis(
    function=follow_branch,
    numbers=_numbers,
    results=(
        "a row per value: `motions`, how many there are, and how many are `stable`. The first has what is special too, "
        "`fold_1`, `flip_1`: values of the parameter. With a quantity of a period as `of`, as `max(x)`, each row has "
        "it of all motions there, ascending: `max(x)_1` and its derivative by the parameter, `max(x)_1_slope`"
    ),
    example="discontinuous_support --forcing omega --set omega=0.8 --over omega=0.8:1.4 --figure b.png",
    label="following",
    axes=RANGE,
    without=(*CROSSED, "workers", "scheduler"),
    page=False,
)
