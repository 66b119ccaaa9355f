"""Laws that start from the sliders of a log: each with its declaration, its parameters and where a search begins."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import sympy

from fmu_models.language.declaration import Output
from fmu_models.language.hysteresis.bouc_wen import BoucWen
from fmu_models.language.hysteresis.bouc_wen_baber_noori import BoucWenBaberNoori
from fmu_models.language.hysteresis.contact import Hysteresis
from fmu_models.language.hysteresis.dahl import Dahl
from fmu_models.language.hysteresis.iwan4 import Iwan4
from fmu_models.language.hysteresis.law import HysteresisLaw, OfSlip
from fmu_models.language.hysteresis.play import Play
from fmu_models.language.hysteresis.sliders import MaxwellSlip
from fmu_models.language.laws.conti import Conti
from fmu_models.language.laws.lugre import LuGre
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Input, Parameter
from identification.hysteresis.spectrum import SliderSpectrum

WAY, LOAD, FORCE, HELD = "way", "load", "force", "h"
CENTER, MEDIAN = "center", "median_load"
FREED = 8  # sliders of a joint that begins to slip little by little
Values = Mapping[str, float]


@dataclass(frozen=True)
class LoopLaw:
    """A law as it is fitted to loops. name: as the command takes it; law: with its parameters; first: first values of
    its parameters, from the sliders; guesses: starts of the search that are scored; 1: the first values are near;
    bounds: of the search, by parameter, for first values; timed: it depends on the speed."""

    name: str
    law: HysteresisLaw
    first: Callable[[SliderSpectrum], dict[str, float]]
    guesses: int = 1
    bounds: Callable[[SliderSpectrum], dict[str, tuple[float, float]]] = lambda spectrum: {}
    timed: bool = False

    def at(self, values: Values) -> HysteresisLaw:
        """The law in numbers, for a mechanism of one's own."""
        return _in_numbers(self.law, values)

    def saturated(self, values: Values, reach: float) -> dict[str, float]:
        """States at a far turn in positive direction, m, of a way that goes ``reach`` to either side."""
        law = self.at(values)
        full = [min(float(value), reach) for value in law.lowered.full]
        return {state.name: value for state, value in zip(law.lowered.states(HELD, "m"), full, strict=False)}


def loop_name(law: LoopLaw, rate: bool) -> str:
    """Of the model of a law, with a damper or without."""
    return f"loop_{law.name.lower().replace('-', '_')}" + ("_damped" if rate else "")


def loop_model(law: LoopLaw, *, rate: bool) -> Mechanism:
    """The law along a way that an input prescribes, beside a spring, an offset and, with ``rate``, a damper; the load
    is another input, of which the force is a factor."""
    way, load = Input(WAY, 0.0, "m", "displacement"), Input(LOAD, 1.0, "N", "load that scales the law")
    center = Parameter(CENTER, 0.0, "m", "middle of the way")
    median = Parameter(MEDIAN, 1.0, "N", "load at which the parameters of the law hold", positive=True)
    rest = Coordinate("rest", "m", "a body that nothing moves", velocity="rest_speed")
    mass = Parameter("rest_mass", 1.0, "kg", "mass of the body that nothing moves", positive=True)
    spring, offset, damper = (
        Parameter(name, 0.0, unit, meaning)
        for name, unit, meaning in (
            ("spring", "N/m", "stiffness beside the law"),
            ("offset", "N", "force in the middle of the way"),
            ("damping", "N s/m", "viscous damping beside the law"),
        )
    )
    held = Hysteresis(name=HELD, way=way, law=law.law, load=load / median, damping=damper if rate else sympy.S.Zero)
    return Mechanism(
        name=loop_name(law, rate),
        title=f"Force of {law.name} along a way",
        source="fmu_models.language.hysteresis",
        coordinates=[rest],
        kinetic_energy=mass * rest.v**2 / 2,
        contacts=[held],
        outputs=[Output(FORCE, held.force + spring * (way - center) + offset, "N", "force that resists the way")],
    )


def _stiff(name: str = "k", meaning: str = "stiffness at rest") -> Parameter:
    return Parameter(name, 1.0, "N/m", meaning, positive=True)


def _sliders(count: int) -> LoopLaw:
    law = MaxwellSlip(
        k=[_stiff(f"k_{i}", f"stiffness of spring {i}") for i in range(1, count + 1)],
        D=[
            Parameter(f"D_{i}", i, "m", f"elongation at which slider {i} gives way", positive=True)
            for i in range(1, count + 1)
        ],
    )
    return LoopLaw(f"MaxwellSlip-{count}", law, lambda spectrum: _merged(spectrum, count))


def _merged(spectrum: SliderSpectrum, count: int) -> dict[str, float]:
    """So many sliders with the stiffness and the force at full slip of what they stand for: parts of equal force."""
    k, bound = spectrum.at(), spectrum.bound
    k, bound = k[spectrum.slides], bound[spectrum.slides]
    force = np.cumsum(k * bound) - k * bound / 2
    bin_of = np.minimum((count * force / max(force[-1] * 1.0000001, 1e-300)).astype(int), count - 1)
    values = {}
    for i in range(count):
        stiffness, full = k[bin_of == i].sum(), (k * bound)[bin_of == i].sum()
        if stiffness <= 0:  # fewer sliders than asked: one that does next to nothing, to begin with
            stiffness = 1e-3 * k.sum()
            full = stiffness * bound[-1] * (i + 1) / count
        values |= {f"k_{i + 1}": float(stiffness), f"D_{i + 1}": float(full / stiffness)}
    return values


def _bouc_wen(n: int) -> Callable[[SliderSpectrum], dict[str, float]]:
    def first(spectrum: SliderSpectrum) -> dict[str, float]:
        stiffness = spectrum.stiffness_at_rest()
        half = (stiffness / spectrum.sliding_force()) ** n / 2
        return {"k": stiffness, "beta": half, "gamma": half}

    return first


def _shape(name: str, n: int) -> Parameter:
    return Parameter(name, 1.0, f"1/m{n}" if n > 1 else "1/m", f"shape of the loop, {name}")


def _of_bouc_wen(n: int) -> BoucWen:
    return BoucWen(k=_stiff(), beta=_shape("beta", n), gamma=_shape("gamma", n), n=n)


def _pinched(spectrum: SliderSpectrum) -> dict[str, float]:
    reach = spectrum.reach
    values = _bouc_wen(1)(spectrum)
    return {
        **{"k": 2 * values["k"], "beta": values["beta"], "gamma": 0.5 * values["gamma"]},
        **{"delta_nu": 0.05 / reach**2, "delta_eta": 0.1 / reach**2, "zeta_s": 0.9, "p": 1 / reach**2, "q": 0.05},
        **{"psi": 0.2 * reach, "delta_psi": 0.05 / reach, "xi": 0.3},
    }


def _either_gamma(
    first: Callable[[SliderSpectrum], dict[str, float]], spectrum: SliderSpectrum
) -> dict[str, tuple[float, float]]:
    """gamma of either sign."""
    beta = first(spectrum)["beta"]
    return {"beta": (1e-3 * beta, 1e3 * beta), "gamma": (-1e3 * beta, 1e3 * beta)}


def _wide(first: Values) -> dict[str, tuple[float, float]]:
    """Bounds around first values of which nothing but the size is known."""
    return {name: (value / 30, 30 * value) for name, value in first.items()}


def _pinched_bounds(spectrum: SliderSpectrum) -> dict[str, tuple[float, float]]:
    first = _pinched(spectrum)
    return _wide(first) | {"gamma": (-first["beta"], 10 * first["beta"]), "zeta_s": (0.0, 0.999), "q": (0.0, 0.5)}


_ENERGY = {
    "delta_nu": ("1/m2", "loss of strength with energy"),
    "delta_eta": ("1/m2", "loss of stiffness with energy"),
    "zeta_s": ("1", "share of the slope that pinching takes"),
    "p": ("1/m2", "how soon pinching comes with energy"),
    "q": ("1", "where pinching is, in parts of the largest z"),
    "psi": ("m", "width of pinching"),
    "delta_psi": ("1/m", "rise of the width of pinching with energy"),
    "xi": ("1", "what width and severity of pinching share"),
}
PINCHED = BoucWenBaberNoori(
    k=_stiff(),
    beta=_shape("beta", 1),
    gamma=_shape("gamma", 1),
    n=1,
    **{name: Parameter(name, 0.1, unit, meaning, minimum=0.0) for name, (unit, meaning) in _ENERGY.items()},
)

_DAHL = LoopLaw(
    "Dahl",
    Dahl(sigma=_stiff("sigma"), F_c=Parameter("F_c", 1.0, "N", "sliding force", positive=True)),
    lambda spectrum: {"sigma": spectrum.stiffness_at_rest(), "F_c": spectrum.sliding_force()},
)


def _behind_play(law: LoopLaw) -> LoopLaw:
    """The law behind a backlash, whose width nothing tells beforehand; sliders have taken it for softness."""
    w = Parameter("w", 0.01, "m", "backlash to either side", positive=True)

    def first(spectrum: SliderSpectrum) -> dict[str, float]:
        return {**law.first(spectrum), "w": spectrum.reach / 10}

    def bounds(spectrum: SliderSpectrum) -> dict[str, tuple[float, float]]:
        return _wide(law.first(spectrum)) | {"w": (spectrum.reach / 300, 0.9 * spectrum.reach)}

    return LoopLaw(f"Play-{law.name}", Play(law.law, w), first, guesses=64, bounds=bounds)


def _first_bristles(spectrum: SliderSpectrum) -> dict[str, float]:
    force = spectrum.sliding_force()
    falling = {"F_k": 0.95 * force, "F_f": 0.1 * force, "p": 20 / float(spectrum.widths.max(initial=1e-300))}
    return falling | {"sigma0": spectrum.stiffness_at_rest(), "sigma1": 0.0}


def _bristle_bounds(spectrum: SliderSpectrum) -> dict[str, tuple[float, float]]:
    """What falls by much, or only where speeds are nil, cannot be told from bristles alone."""
    first = _first_bristles(spectrum)
    return {"F_f": (0.0, 20 * first["F_f"]), "p": (first["p"] / 100, 10 * first["p"])}


_KINETIC = Parameter("F_k", 1.0, "N", "sliding force at great speed", positive=True)
_BRISTLES = LuGre(
    steady=Conti(
        N=sympy.S.One,
        mu_s=_KINETIC + Parameter("F_f", 0.1, "N", "by how much it falls with the speed", minimum=0.0),
        mu_k=_KINETIC,
        p=Parameter("p", 1.0, "s/m", "how soon it falls", minimum=0.0),
    ),
    sigma0=_stiff("sigma0"),
    sigma1=Parameter("sigma1", 0.0, "N s/m", "damping of the bristles", minimum=0.0),
)


LAWS: dict[str, LoopLaw] = {
    law.name: law
    for law in (
        _sliders(1),
        _sliders(2),
        _sliders(3),
        _sliders(4),
        _DAHL,
        LoopLaw("LuGre", OfSlip(_BRISTLES), _first_bristles, bounds=_bristle_bounds, timed=True),
        _behind_play(_sliders(2)),
        _behind_play(_DAHL),
        LoopLaw(
            "Iwan4",
            Iwan4(
                F_S=Parameter("F_S", 1.0, "N", "sliding force", positive=True),
                K_T=_stiff("K_T"),
                chi=Parameter("chi", -0.3, "1", "exponent of the dissipation less 3", minimum=-0.99, maximum=2.0),
                beta=Parameter("beta_S", 0.5, "1", "share of what lets go at once", positive=True),
                sliders=FREED,
            ),
            lambda s: {"F_S": s.sliding_force(), "K_T": s.stiffness_at_rest(), "chi": -0.3, "beta_S": 0.5},
        ),
        *(
            LoopLaw(f"BoucWen-{n}", _of_bouc_wen(n), _bouc_wen(n), bounds=partial(_either_gamma, _bouc_wen(n)))
            for n in (1, 2)
        ),
        LoopLaw("BoucWenBaberNoori", PINCHED, _pinched, guesses=64, bounds=_pinched_bounds),
    )
}
USUAL = ("MaxwellSlip-2", "MaxwellSlip-4", "Dahl", "BoucWen-1", "BoucWen-2")


def _in_numbers(law: Any, values: Values) -> HysteresisLaw:
    def number(part: object) -> object:
        if isinstance(part, sympy.Expr) and all(isinstance(s, Parameter) for s in part.free_symbols):
            return float(part.subs({s: values[str(s)] for s in part.free_symbols}))
        if is_dataclass(part):
            return _in_numbers(part, values)
        return [number(inner) for inner in part] if isinstance(part, list | tuple) else part

    return replace(law, **{entry.name: number(getattr(law, entry.name)) for entry in fields(law)})
