"""mu (1 + d s), s = 1 where the disc is the faster one and -1 where the body is: the law is the mean of both."""

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import DisturbanceTerm, Effect

SIDED = Effect("direction", lambda at, order, functions: at.side, width=lambda order: 0.1)
DISTURBANCE = Disturbance(
    words="friction is greater one way than the other; --law 'Conti by direction' has a law for each",
    terms=lambda ready, size: [DisturbanceTerm("direction", SIDED)],
    hidden=lambda ready: "" if ready.slips_both_ways else "all slip one way. Add a log with the drive reversed.",
    told_by="both directions at the same speed, and a free decay, which shows the zero",
    rank=13,
    emulated=("direction",),
)
