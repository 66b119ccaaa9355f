"""mu (1 + s_i + t_i u), i the number of the log and u the share of it that is gone, from -1/2 to 1/2; s_1 = 0."""

from identification.disturbances.disturbance import Disturbance
from identification.disturbances.term import DisturbanceTerm, Effect
from identification.measurement.pooled import Pool

TIME = Effect(
    "time",
    lambda at, order, functions: at.share**order,
    lambda order: f"of power {order} of the share of the log",
    width=lambda order: 0.01,
)


def _terms(ready: Pool, size: float | None) -> list[DisturbanceTerm]:
    logs = range(len(ready.motions))
    scales = [DisturbanceTerm(f"scale_{log + 1}", TIME, 0, log) for log in logs if log]
    return [*scales, *(DisturbanceTerm(f"trend_{log + 1}", TIME, 1, log) for log in logs)]


DISTURBANCE = Disturbance(
    words="friction changes with time, within the logs or from one to the next (wear, heat, humidity)",
    terms=_terms,
    told_by="the same logs in another order",
    rank=3,
    remark=lambda ready, terms, values: "; one log shows no change from log to log" if len(ready.motions) == 1 else "",
    emulated=("per_log", "within"),
)
