"""What friction follows of what a bench records beside the motion, normal force and temperature: what is assumed of
them, and how much worse the same law is without."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence

import numpy as np

from fmu_models.base.errors import StickslipError
from identification.disturbances.load_cell import CELL
from identification.disturbances.temperature import CAUSE as TEMPERATURE
from identification.disturbances.temperature import TERM
from identification.disturbances.term import DisturbanceTerm
from identification.disturbances.terms import terms_of
from identification.estimators.base import Options
from identification.estimators.weak_form import of_few_nodes
from identification.inference.problem import solve
from identification.laws.law import FittableLaw
from identification.measurement.pooled import Pool
from identification.measurement.stated import weighed

FREEZES = 273.15  # K
FORCE, AT = "friction is in proportion to the normal force of the load cell, ", "the law is that at "


def followed_in(structure: Sequence[str]) -> tuple[str, ...]:
    """What a fit that is read back assumed of normal force and temperature, as sentences."""
    return tuple(f"Assumed: {line}." for line in structure if line.startswith((FORCE, AT)))


def followed(ready: Pool, law: FittableLaw, held: Container[str] = ()) -> Iterator[str]:
    """What a fit assumes of the normal force and the temperature of one disc. law: a steady one, by which it is judged
    how much worse it is where either is ignored; held: unknowns that were not sought, of which nothing is said."""
    terms = terms_of(ready, ()) if len(ready.contacts) == 1 else ()
    if weighed(ready.motions) and terms and CELL not in held:
        force = np.concatenate([motion.loads[0] for motion in ready.motions if motion.loads is not None])
        yield (
            f"{FORCE}{force.min():.3g} to {force.max():.3g} N"
            + _missed(ready, law, terms, CELL, "where it is taken as its mean")
        )
    rows = [motion.warmer for motion in ready.motions if motion.warmer is not None]
    if ready.temperature is None or len(ready.contacts) > 1 or TERM.name in held:
        return
    mean, change = ready.temperature, np.concatenate(rows)
    span = f"{mean + change.min():.4g} to {mean + change.max():.4g} K"
    if not ready.warms:
        yield f"the temperature, {span}, changes too little to show its effect on friction"
        return
    yield (
        f"{AT}{mean:.4g} K ({mean - FREEZES:.3g} degC), and friction 1 + a_T (T - {mean:.4g} K) times "
        f"it, {span}" + _missed(ready, law, terms, TEMPERATURE, "where the temperature is ignored")
    )


def _missed(ready: Pool, law: FittableLaw, terms: tuple[DisturbanceTerm, ...], cause: str, ignored: str) -> str:
    """What the weak form leaves of friction with these terms, and without those of a cause; nothing where it cannot
    tell."""
    left = []
    for kept in (terms, tuple(term for term in terms if term.cause != cause)):
        try:
            problem = of_few_nodes(ready, law, Options(disturbances=kept))
            share = problem.rms(solve(problem).values) / float(np.sqrt(np.mean(problem.regression.measured**2)))
        except StickslipError:
            return ""
        left.append(f"{100 * share:.2g} %")
    return f" (the law misses friction by {left[0]}, by {left[1]} {ignored})"
