"""What a run of any FMU says of itself."""

import ctypes

from fmu_models.fmu.fmu import Fmu
from fmu_models.importer import request
from fmu_models.importer.motion_error import PATTERN, ZENO

NAMES = {
    "co-simulation": "co-simulation",
    "scheduled": "scheduled execution",
    "dopri5": "Dormand-Prince 5(4)",
    "dop853": "Dormand-Prince 8(5,3)",
    "stiff": "Radau IIA of order 5",
}
PATTERNS = {PATTERN.DECLARED: "as its declared dependencies allow", PATTERN.FOUND: "from dependencies found by probing"}


def note(method: str, c: ctypes.Structure) -> str:
    """The method of a run in words."""
    text = NAMES.get(method, NAMES["dop853"])
    if method == "auto" and c.n_switches:
        text += f", from t = {c.switch_time:.6g} s {NAMES['stiff']}, because stability limited the steps"
        if c.n_switches > 1:
            text += f" ({c.n_switches} changes between the two)"
    if c.pattern in PATTERNS:
        text += f", Jacobians by {c.colours} evaluations, {PATTERNS[c.pattern]}"
    if c.undeclared:
        text += f" (the dependencies that the FMU declares are wrong: {c.undeclared} are missing)"
    if c.accumulations:
        done = "held from there on" if c.on_zeno == ZENO.HOLD else "continued as the FMU does"
        text += f"; events accumulate at t = {c.accumulation_time:.9g} s, {done}"
    if c.slides:
        text += f"; {c.slides} sliding motion{'s' if c.slides > 1 else ''} by the convex mean of the fields"
    if c.most_surfaces > 1:
        text += f", along {c.most_surfaces} surfaces at once"
    if c.by_convention:
        text += " (their fields are no sum of one term for each surface: the mean is a convention there)"
    if c.unresolved:
        text += (
            f"; event indicator {c.unresolved_indicator} changes from t = {c.unresolved_time:.6g} s on faster than "
            "steps can follow: events of it may be missed"
        )
    return text


def nothing_to_record(fmu: Fmu) -> str:
    """Why there is nothing to record."""
    unrecordable = request.unrecordable(fmu)
    has = f"its outputs are {', '.join(unrecordable)}" if unrecordable else "it has neither states nor outputs"
    return (
        f"'{fmu.path}' gives no number that a run would record: {has}. Name variables that are numbers to record, or "
        "ask its author for outputs."
    )
