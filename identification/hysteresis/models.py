"""Models of fits of loops and decays, each by its name, such as ``identification.hysteresis.models:loop_dahl``.

A result names its model so, and whatever takes a model takes that name: `calibrate`, `simulate`, `export`, `explore`.
"""

from functools import partial

from fmu_models.language.mechanism import Mechanism
from identification.hysteresis.decay import decay_model
from identification.hysteresis.laws import LAWS, loop_model, loop_name

_MODELS = {
    **{loop_name(law, rate): partial(loop_model, law, rate=rate) for law in LAWS.values() for rate in (False, True)},
    **{f"decaying_{what}": partial(decay_model, pendulum=what == "pendulum") for what in ("pendulum", "oscillator")},
}


def __getattr__(name: str) -> Mechanism:
    if name not in _MODELS:
        raise AttributeError(f"There is no model '{name}' of loops or decays.")
    return _MODELS[name]()
