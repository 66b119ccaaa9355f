"""What a real bench adds to the emulated one, each disturbance with its size.

    friction  lambda = -load(t) (1 + g(theta)) N mu(|v|) sgn(v)
    load(t)   = (1 + once sin(phi + a) + twice sin(2 phi + b)) (1 + per_log n + within (t/T - 1/2))
    g(theta)  = size (x + x^2/2 - 3 x^3/2)/(largest for |x| <= 1),   x = (theta - ANGLE)/REACH
    laser     shows R sin(theta) + offset_n + drift_n(t);   both angle sensors show theta + zero

phi angle of the drive, n number of the log, t and T its time and duration. Drifts are sums of three slow sines, of the
size stated where they are largest. The counters of the drives run on from log to log. Whatever else there is adds to
one quantity, see `KINDS`; some of it is known to no estimator.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import accumulate
from typing import TYPE_CHECKING, Any

import numpy as np

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown
from rig_io.bench.settings import sized

if TYPE_CHECKING:
    from fmu_models.fmu.fmu import Fmu

ANGLE, REACH = 0.1, 0.1  # rad: where the friction is as declared, and how far from there the disc of the rig swings
PERIODS = (15.0, 80.0)  # s, of the sines of a drift
SINES = 3
LARGEST = 0.5  # of any relative disturbance of friction
SHAKEN, ALIASED, ROCKED = 37.0, 1003.0, 3.3  # Hz
WARMING, TURN = 10.0, 0.5  # s; rad, at which an eccentric encoder shows its angle
MAGNET, NARROW, CABLE, ROUNDED = 0.06, 0.012, 0.08, 1e-3  # rad: where, how wide, from where on, how sharp
SLOW = 1e-3  # rad/s, below which |omega| is rounded off
_SHAPE = np.array([0.0, 1.0, 0.5, -1.5])


@dataclass(frozen=True, eq=False)
class Moment:
    """time (n,): s of the log, which lasts ``duration``; at (n,): rad, angle of the body or drive, or a count."""

    time: np.ndarray
    at: np.ndarray
    duration: float
    noise: np.random.Generator


@dataclass(frozen=True)
class Kind:
    """What may disturb. unit: of its size; acts: on what it adds to (`_LOAD` ...), nothing where `Disturbances` has it;
    added: (size, moment) -> (n,), or (size, angle, speed) -> torque as an expression; known: to estimators."""

    unit: str
    acts: str = ""
    added: Callable[..., Any] = lambda size, m: 0.0
    known: bool = True


_LOAD, _TORQUE, _BODY, _LASER, _READ = "load", "torque", "body", "laser", "read"


def _rough(m: Moment, slowest: float, fastest: float) -> np.ndarray:
    """Noise between two rates, Hz, of deviation 1."""
    rates = 2 * np.pi * np.exp(m.noise.uniform(np.log(slowest), np.log(fastest), 12))
    return np.sum(np.sin(rates * m.time[:, None] + m.noise.uniform(0, 6.28, 12)), axis=1) / np.sqrt(6)


def _sine(m: Moment, rate: float) -> np.ndarray:
    return np.sin(2 * np.pi * (rate * m.time + m.noise.random()))


def _fading(m: Moment) -> np.ndarray:
    return np.exp(-np.maximum(m.time, 0) / WARMING) - WARMING / m.duration * (1 - np.exp(-m.duration / WARMING))


def _magnetic(size: float, angle: Any, speed: Any) -> Any:
    x = (angle - MAGNET) / NARROW
    return size * x / (1 + x**2) ** 2


def _pulling(size: float, angle: Any, speed: Any) -> Any:
    over = angle - CABLE
    return -size * (over + (over**2 + ROUNDED**2) ** 0.5) / 2


def _slack(size: float, m: Moment) -> np.ndarray:
    """What a shaft behind a play of this width lacks: it is taken along at either end."""
    half = size / 2
    return np.array(list(accumulate(m.at.tolist(), lambda y, x: min(max(y, x - half), x + half)))) - m.at


KINDS: Mapping[str, Kind] = {
    **dict.fromkeys(("once", "twice", "angle", "per_log", "within"), Kind("1")),
    **{"offset": Kind("m"), "drift": Kind("m"), "zero": Kind("rad")},
    "direction": Kind("1", _LOAD, lambda size, m: size * np.sign(m.at[-1] - m.at[0])),
    "warm_up": Kind("1", _LOAD, lambda size, m: size * _fading(m)),
    "spring": Kind("N*m/rad^3", _BODY, lambda size, angle, speed: -size * angle**3),
    "damping": Kind("N*m*s^2/rad^2", _BODY, lambda size, angle, speed: -size * speed * (speed**2 + SLOW**2) ** 0.5),
    "drive_encoder": Kind("rad", "drive0", lambda size, m: size * np.sin(m.at + TURN)),
    "laser_bend": Kind("m/rad^2", _LASER, lambda size, m: size * m.at**2),
    "vibration": Kind("m", _LASER, lambda size, m: size * _sine(m, SHAKEN)),
    "walk": Kind(
        "m", _LASER, lambda size, m: size * np.cumsum(m.noise.standard_normal(m.time.shape)) / len(m.time) ** 0.5
    ),
    "late": Kind("s", _READ, lambda size, m: -size + 0 * m.time),
    "clock": Kind("1", _READ, lambda size, m: -size * (m.time - m.duration / 2)),
    "lost": Kind(
        "1",
        "encoder_count",
        lambda size, m: -np.searchsorted(np.sort(m.noise.uniform(0, m.duration, int(size))), m.time),
    ),
    "body_encoder": Kind("rad", "encoder", lambda size, m: size * np.sin(m.at + TURN), known=False),
    "bearing": Kind("N*m", _TORQUE, lambda size, m: size * _rough(m, 1.0, 15.0), known=False),
    "draft": Kind("N*m", _TORQUE, lambda size, m: size * _rough(m, 0.05, 0.8), known=False),
    "rocking": Kind("N*m", _TORQUE, lambda size, m: size * _sine(m, ROCKED), known=False),
    "magnet": Kind("N*m", _BODY, _magnetic, known=False),
    "cable": Kind("N*m/rad", _BODY, _pulling),
    "aliasing": Kind("m", _LASER, lambda size, m: size * _sine(m, ALIASED), known=False),
    "laser_gain": Kind("m/rad", _LASER, lambda size, m: size * m.at * np.exp(-m.time / WARMING)),
    "overflow": Kind("1", "drive0_count", lambda size, m: -size * np.round(m.at / size), known=False),
    "stamps": Kind("s", "edge_time", lambda size, m: -np.mod(m.time, size), known=False),
    "belt": Kind("1", "drive0", lambda size, m: size * m.at),
    "backlash": Kind("rad", "encoder", _slack, known=False),
    "settling": Kind("m", _LASER, lambda size, m: size * np.exp(-m.time / WARMING), known=False),
}


@dataclass(frozen=True, init=False)
class Disturbances(Shown):
    """Sizes by name; those of friction are relative. once, twice: amplitudes of the normal force per turn of the drive;
    angle: greatest change of the friction with the disc's angle; per_log, within: wear from log to log and from begin
    to end of a log; offset, drift: m, standard deviation over logs and greatest value; zero: rad; others: `KINDS`."""

    sizes: Mapping[str, float]

    def __init__(self, **sizes: float) -> None:
        """Raises StickslipError: no disturbance of that name, or out of range."""
        for name, size in sizes.items():
            refuse_unknown(name, KINDS, f"There is no disturbance '{name}' ({', '.join(KINDS)}).")
            if KINDS[name].acts in ("", _LOAD) and KINDS[name].unit == "1" and not abs(size) <= LARGEST:
                raise StickslipError(
                    f"A disturbance '{name}' of {size:g} is out of range: it is a share of the friction, up to "
                    f"{LARGEST:g}."
                )
        object.__setattr__(self, "sizes", {name: size for name, size in sizes.items() if size})

    def size(self, name: str) -> float:
        """0 of what is not there."""
        return self.sizes.get(name, 0.0)

    @staticmethod
    def said(texts: Sequence[str]) -> Disturbances:
        """Disturbances from texts such as "once=5%", "drift=0.3mm", "zero=2mrad"; a number without unit is SI.
        StickslipError: no disturbance of that name, no size, a unit that does not fit, a name twice, out of range."""
        sizes: dict[str, float] = {}
        for text in texts:
            name, _, size = (side.strip() for side in text.partition("="))
            refuse_unknown(name, KINDS, f"There is no disturbance '{name}' ({', '.join(KINDS)}).")
            if name in sizes:
                raise StickslipError(f"The disturbance '{name}' is given twice. Give it once.")
            unit = KINDS[name].unit
            try:
                sizes[name] = sized(size, unit)
            except ValueError as error:
                raise StickslipError(
                    f"The disturbance '{name}' has no size '{size}' ({error}). Its unit is {unit.replace('1', '%')}. "
                    "Write NAME=SIZE, for example once=5%."
                ) from error
        return Disturbances(**sizes)

    def load(
        self, time: np.ndarray, angle: np.ndarray, duration: float, number: int, specimen: np.random.Generator
    ) -> np.ndarray:
        """Factor (n,) of the normal force at times (n,) in s of the log and angles (n,) in rad of the drive; specimen
        draws the phases."""
        first, second = 2 * np.pi * specimen.random(2)
        turning = 1 + self.size("once") * np.sin(angle + first) + self.size("twice") * np.sin(2 * angle + second)
        more = 1 + self.added(_LOAD, Moment(time, angle, duration, specimen))
        return turning * (1 + self.size("per_log") * number + self.size("within") * (time / duration - 0.5)) * more

    def added(
        self, acts: str, moment: Moment, noise: Callable[[int], np.random.Generator] | None = None
    ) -> np.ndarray | float:
        """What all add to a quantity (n,). noise: by the number of a kind; of the moment if left out."""
        every = [(n, name, kind) for n, (name, kind) in enumerate(KINDS.items()) if kind.acts == acts]
        return sum(
            kind.added(self.sizes[name], moment if noise is None else replace(moment, noise=noise(n)))
            for n, name, kind in every
            if name in self.sizes
        )

    @property
    def moves(self) -> bool:
        """Whether the body moves otherwise, without a disc too."""
        return any(KINDS[name].acts in (_BODY, _TORQUE) for name in self.sizes)

    def by_angle(self, angle: np.ndarray) -> np.ndarray:
        """g at angles (n,) in rad."""
        return np.polynomial.polynomial.polyval((angle - ANGLE) / REACH, self._coefficients)

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of the disturbed oscillator."""
        body = {name: size for name, size in self.sizes.items() if KINDS[name].acts == _BODY}
        return {f"g{power}": float(value) for power, value in enumerate(self._coefficients) if power} | body

    @property
    def _coefficients(self) -> np.ndarray:
        x = np.linspace(-1, 1, 401)
        return self.size("angle") * _SHAPE / np.max(np.abs(np.polynomial.polynomial.polyval(x, _SHAPE)))

    def displacement(self, time: np.ndarray, noise: np.random.Generator) -> np.ndarray:
        """What the laser shows too much (n,), m, at times (n,) in s of a log."""
        offset = self.size("offset") * noise.standard_normal()
        periods = np.exp(noise.uniform(np.log(PERIODS[0]), np.log(PERIODS[1]), SINES))
        phases = 2 * np.pi * noise.random(SINES)
        curve = np.sum(np.sin(2 * np.pi * time[:, None] / periods + phases), axis=1)
        curve = curve - curve.mean()
        return offset + self.size("drift") * curve / np.max(np.abs(curve))


@cache
def disturbed_oscillator(law: str) -> Fmu:
    """The rig with disc 0, under a law, or with none if that is empty: friction follows its input ``load0`` and the
    angle, and the body a torque ``torque0`` and what is its own."""
    from fmu_models.codegen.package import built_of, variant
    from fmu_models.fmu.fmu import Fmu
    from fmu_models.language.friction import Friction
    from fmu_models.language.laws.conti import Conti
    from fmu_models.language.quantities import Input, Parameter
    from fmu_models.lowering.lower import lower

    rig = variant("disc_rig", ["disc0"] if law else [])
    (theta,) = rig.coordinates
    torque = Input("torque0", 0.0, "N*m", "torque beside")
    for name, kind in KINDS.items():
        if kind.acts == _BODY:
            torque = torque + kind.added(
                Parameter(name, 0.0, kind.unit.replace("^", ""), "size of a disturbance"), theta, theta.v
            )
    rig = replace(rig, name="disturbed_rig", applied={theta: torque})
    if not law:
        return Fmu.open(built_of(lower(rig)))
    (contact,) = rig.contacts
    assert isinstance(contact, Friction) and isinstance(contact.law, Conti)
    load = Input("load0", 1.0, "1", "factor of the normal force")
    g = [Parameter(f"g{power}", 0.0, "1", f"change of friction with power {power} of the angle") for power in (1, 2, 3)]
    x = (theta - ANGLE) / REACH
    friction = replace(contact.law, N=contact.law.N * load * (1 + x * (g[0] + x * (g[1] + x * g[2]))))
    return Fmu.open(built_of(lower(variant(rig.with_law(disc0=friction), laws={"disc0": law}))))
