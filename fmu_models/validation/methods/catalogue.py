"""The methods that a comparison runs, in the order of its tables."""

from fmu_models.base.errors import StickslipError, nearest
from fmu_models.validation.methods.event_runge_kutta import EventRungeKutta
from fmu_models.validation.methods.event_taylor import EventTaylor
from fmu_models.validation.methods.exact_flow import ExactFlow
from fmu_models.validation.methods.moreau import Moreau
from fmu_models.validation.methods.peers.fmpy_cvode import FmpyCvode
from fmu_models.validation.methods.peers.heyoka_taylor import HeyokaTaylor
from fmu_models.validation.methods.result import Method
from fmu_models.validation.methods.scipy_events import ScipyEvents
from fmu_models.validation.methods.smoothing import Smoothing
from fmu_models.validation.methods.switch_model import SwitchModel

OURS = EventTaylor()


def methods() -> tuple[Method, ...]:
    """All of them, ours first."""
    return (
        OURS,
        ExactFlow(),
        HeyokaTaylor(),
        ScipyEvents("DOP853"),
        ScipyEvents("RK45"),
        EventRungeKutta("dopri5"),
        EventRungeKutta("dop853"),
        FmpyCvode(),
        # their floors are reached at these tolerances: tighter ones cost and give nothing
        SwitchModel(1e-2, tolerances=(1e-6, 1e-8)),
        SwitchModel(1e-3, tolerances=(1e-6, 1e-8, 1e-10)),
        SwitchModel(1e-4),
        SwitchModel(1e-4, frozen=True, tolerances=(1e-6, 1e-8)),
        Smoothing("tanh", 1e-3, "LSODA"),
        Smoothing("tanh", 1e-3, "RK45", tolerances=(1e-6, 1e-8)),
        Smoothing("tanh", 1e-5, "LSODA"),
        Smoothing("arctan", 1e-3, "LSODA"),
        Smoothing("arctan", 1e-3, "Radau", tolerances=(1e-6, 1e-8)),
        Smoothing("arctan", 1e-5, "LSODA"),
        Moreau(),
    )


def chosen(words: list[str] | None) -> tuple[Method, ...]:
    """The methods whose names contain one of the words; all without words. StickslipError: no name contains one of
    them."""
    everything = methods()
    if not words:
        return everything
    for word in words:
        if not any(word.lower() in method.name.lower() for method in everything):
            hint = nearest(word, [method.name for method in everything])
            raise StickslipError(f"No method has '{word}' in its name.{hint}")
    return tuple(m for m in everything if any(word.lower() in m.name.lower() for word in words))
