"""N (1 + a (F_N/mean(F_N) - 1)): the force of a load cell. It is no disturbance that is sought: where logs have it,
friction follows it."""

from identification.disturbances.term import DisturbanceTerm, Effect
from identification.inference.problem import Prior

CELL = "load"
SURE = 0.01  # 1 of it, give or take so much
LOAD = Effect(
    CELL, lambda at, order, functions: at.load - 1, lambda order: "share of it that friction follows", limits=(0.0, 2.0)
)
TERM = DisturbanceTerm(
    CELL,
    LOAD,
    1,
    prior=Prior(CELL, 1.0, "1", SURE, "load cell"),
    words="share of what the load cell shows that friction follows",
    cause=CELL,
)
