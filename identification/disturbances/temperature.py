"""mu (1 + a (T - T0)), T by a thermometer, T0 its mean over all logs. It is no disturbance that is sought: where it is
recorded and changes, friction may follow it."""

from identification.disturbances.term import DisturbanceTerm, Effect

CAUSE = "temperature"
WARMER = Effect(
    "warmer",
    lambda at, order, functions: at.warmer,
    lambda order: "share by which friction rises with each kelvin",
    measure="1/K",
    limits=(-0.2, 0.2),
    width=lambda order: 0.01,
)
TERM = DisturbanceTerm("a_T", WARMER, words="share by which friction rises with each kelvin", cause=CAUSE)
