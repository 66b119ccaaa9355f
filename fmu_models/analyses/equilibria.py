"""The branch of an equilibrium, with the cycles that leave it, and curves of what is special on it."""

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

from fmu_models.analyses.branch import Followed, numbers_at, special_values
from fmu_models.analyses.declaration import OSCILLATOR, RANGE, Analysis, Option, Range
from fmu_models.continuation.curves.curve import Curves
from fmu_models.continuation.equilibria import equilibria
from fmu_models.fmu.fmu import Fmu


def follow_equilibria(
    fmu: Fmu,
    over: str,
    between: tuple[float, float],
    *,
    start: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    switch: Annotated[bool, Option("Cycles that leave it to follow too: none, all.", words=("none", "all"))] = False,
    curve: Annotated[Range | None, Option("Folds, Hopf points as curves in this parameter too.")] = None,
    points: Annotated[int, Option("Equilibria, or cycles, in each direction, at most.", minimum=2)] = 2000,
    of: Annotated[str | None, Option("State that is drawn, or eigenvalues.", default="the first state")] = None,
    progress: Callable[[float], Any] = lambda fraction: None,
) -> Followed:
    """Follow an equilibrium over a parameter, with its eigenvalues: folds, Hopf points, switching surfaces.

    Args:
        others: as for ``equilibria``.
        switch: follow the cycles that leave it too.
        curve: name, least and largest value of a second parameter.

    Raises:
        StickslipError: as ``equilibria`` and ``EquilibriumBranch.curves``.
    """
    branch = equilibria(fmu, over, between, start=start, parameters=parameters, of=of, points=points, progress=progress)
    if switch and not branch.interrupted:
        branch = branch.with_cycles(points)
    if curve is None or branch.interrupted:
        return Followed(branch)
    return Followed(branch, Curves(branch.curves(curve[0], curve[1:])))


def _numbers(followed: Followed, values: Sequence[float]) -> list[tuple[float, dict[str, float]]]:
    branch: Any = followed.branch
    special = special_values(branch.special)
    for point in branch.special:
        for name, shares in point.crossings.items():
            special |= {f"q_{name.replace(' ', '_')}_{i}": share for i, share in enumerate(shares, 1)}
    return numbers_at([branch], values, "equilibria", special)


ANALYSIS = Analysis(
    function=follow_equilibria,
    numbers=_numbers,
    results=(
        "a row per value: `equilibria`, how many there are, and how many are `stable`. The first has what is special "
        "too, `Hopf_1`, `fold_1`: values of the parameter, and, where eigenvalues are a set, the shares at which it "
        "bifurcates, `q_imaginary_axis_1`"
    ),
    example="planar_hopf --over mu=-1:1 --start x1=-1.5 --start x2=0 --switch all --figure e.png",
    label="following",
    axes=RANGE,
    subject=OSCILLATOR,
    page=False,
)
