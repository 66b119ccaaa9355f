"""Which law the logs of the rig ask for: friction laws on the same logs, and a rigid contact against bristles.

How laws are compared: `inference.comparison`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fmu_models.base.errors import StickslipError
from identification.estimators import ESTIMATORS
from identification.estimators.base import Options
from identification.inference.comparison import LawComparison, compare_problems, single_law
from identification.laws import find_law, slip_laws
from identification.measurement.pooling import Pool, pool
from rig_io.logs.log import RigLog

RIGID, BRISTLES = "Conti, rigid", "LuGre"


def compare_laws(
    logs: Sequence[RigLog] | Pool,
    laws: Sequence[str] | None = None,
    *,
    estimator: str = "weak-form",
    progress: Callable[[float], None] | None = None,
) -> LawComparison:
    """Compare friction laws on the same logs, all pooled.

    logs: as for `fit_friction`; laws: as `find_law` takes them; all of slip speed alone if None; estimator: one that
    reduces the logs in the same way for every law.

    Raises:
        StickslipError: as in `compare_problems`, or the logs cannot be fitted.
    """
    ready = logs if isinstance(logs, Pool) else pool(logs)
    chosen = ESTIMATORS.load(estimator)
    sought = slip_laws() if laws is None else {name: find_law(name) for name in laws}
    problems = {name: chosen.estimate(ready, law, Options()).problem for name, law in sought.items()}
    return compare_problems(problems, [motion.log.name for motion in ready.motions], progress=progress)


def compare_contacts(
    logs: Sequence[RigLog] | Pool, *, progress: Callable[[float], None] | None = None
) -> LawComparison:
    """Compare a rigid contact with bristles (LuGre) before the same law (Conti's), by the output error of whole cycles,
    in which alone the two differ.

    Raises:
        StickslipError: the logs cannot be followed through whole cycles by both, or as in `compare_problems`.
    """
    ready = logs if isinstance(logs, Pool) else pool(logs)
    names = [motion.log.name for motion in ready.motions]
    made = {}
    for number, (name, estimator) in enumerate({RIGID: "whole-cycle", BRISTLES: "lugre"}.items()):
        made[name] = ESTIMATORS.load(estimator).estimate(ready, find_law("Conti"), Options())
        if progress is not None:
            progress(0.3 * (number + 1))
    rigid, elastic = made[RIGID], made[BRISTLES]
    if rigid.estimator.name != "whole-cycle":
        raise StickslipError(f"Rigid contact and bristles cannot be compared. {' '.join(rigid.warnings)}")
    if elastic.estimator.name != "lugre":
        return single_law(RIGID, rigid.problem, rigid.solution, names, " ".join(elastic.warnings))
    return compare_problems(
        {name: one.problem for name, one in made.items()},
        names,
        solutions={name: one.solution for name, one in made.items()},
        progress=None if progress is None else lambda done: progress(0.6 + 0.4 * done),
    )
