"""Friction pairs of the bench and their laws, as published."""

from collections.abc import Mapping
from dataclasses import dataclass

from fmu_models.base.errors import refuse_unknown

CONTI = "conti"


@dataclass(frozen=True)
class Material:
    """A friction pair, and the parameters of its law, in SI: mu_s, mu_k, p of Conti's, or those of another one that is
    declared (its name, file or module)."""

    name: str
    values: Mapping[str, float]
    law: str = CONTI


# the paper's Table 1
MATERIALS: Mapping[str, Material] = {
    m.name: m
    for m in (
        Material("paper/paper", {"mu_s": 0.35, "mu_k": 0.25, "p": 15.0}),
        Material("liner/rubber", {"mu_s": 0.50, "mu_k": 0.33, "p": 20.0}),
        Material("paper/rubber", {"mu_s": 0.65, "mu_k": 0.35, "p": 15.0}),
    )
}
# drive speeds (rad/s) that tell the three parameters apart and still show stick at the standard normal force: the
# largest brings the slip speed to 2/p and beyond (paper/rubber 2.7/p, liner/rubber 2.1/p; paper/paper, which loses
# stick above 0.54 rad/s, gets no further than 0.95/p, and below 0.1 rad/s its slips are too short)
STANDARD_SPEEDS: Mapping[str, tuple[float, ...]] = {
    "paper/paper": (0.13, 0.35, 0.52),
    "liner/rubber": (0.2, 0.41, 0.83),
    "paper/rubber": (0.41, 0.83, 1.4),
}


def material(name: str) -> Material:
    """A friction pair of Table 1 by name.

    Raises:
        StickslipError: unknown name.
    """
    refuse_unknown(name, MATERIALS, f"There is no material '{name}'.")
    return MATERIALS[name]
