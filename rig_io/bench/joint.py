"""A bench that moves a joint of any law with memory, and what its instruments show of it.

    F = G (1 + one_sided (G > 0)) + cubic y^3 + inertia y''
    G = L(t) (law(y) + saturated tanh(y'/width) + viscous y')
    L = (N(t)/N) (1 + softening (T(t) - T_0)) (1 - wear s(t)/s(end))
    shown:  x = y + F/frame + backlash b(F) + noise,    F(t - lag) + offset + drift t/t(end) + noise, perhaps turned

y way of the joint, s the way it has gone, b from -1 to 1 while F changes its side. What stands below ``frame`` in the
settings is known to no estimator.
"""

import ast
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from functools import cache
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.unit_names import conversion
from fmu_models.fmu.fmu import Fmu
from fmu_models.fmu.load import load
from fmu_models.language.declaration import Output
from fmu_models.language.hysteresis.bouc_wen import BoucWen
from fmu_models.language.hysteresis.bouc_wen_baber_noori import BoucWenBaberNoori
from fmu_models.language.hysteresis.contact import Hysteresis
from fmu_models.language.hysteresis.dahl import Dahl
from fmu_models.language.hysteresis.iwan4 import Iwan4
from fmu_models.language.hysteresis.play import Play
from fmu_models.language.hysteresis.sliders import MaxwellSlip
from fmu_models.language.laws.coulomb import Coulomb
from fmu_models.language.laws.lugre import LuGre
from fmu_models.language.laws.stribeck import Stribeck
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Input, Parameter
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal
from rig_io.bench.settings import Recorded, check_settings, setting

LAWS = (MaxwellSlip, Dahl, BoucWen, BoucWenBaberNoori, Iwan4, Play, LuGre, Coulomb, Stribeck)
FINE = 400  # samples of the truth in a cycle, at least
SETTLED, ROOM = 0.01, 20.0  # of the largest force: over which a backlash is crossed; degC of T_0
WAYS: dict[str, Callable[[np.ndarray, np.random.Generator], np.ndarray]] = {
    "sine": lambda phase, rng: np.sin(phase),
    "triangle": lambda phase, rng: 2 / np.pi * np.arcsin(np.sin(phase)),
    "growing": lambda phase, rng: (0.2 + 0.8 * phase / phase[-1]) * np.sin(phase),
    "random": lambda phase, rng: _random(phase, rng),
}


@dataclass(frozen=True)
class JointBench:
    """A bench for a joint, see the module."""

    law: str = setting("MaxwellSlip(k=[3e5, 1e5], D=[5e-4, 2e-3])", "law with numbers; Play(law, w=...) too")
    programme: str = setting("growing", "of the way", words=tuple(WAYS))
    amplitude: float = setting(5e-3, "largest way", "m", least=1e-12)
    rate: float = setting(1.0, "cycles in a second, of random ways about", "Hz", least=1e-9)
    cycles: float = setting(8.0, "number of them", "1", least=1.0)
    sampling_rate: float = setting(200.0, "of the log", "Hz", least=1e-9)
    cut: float = setting(0.0, "when the log begins", "s", least=0.0)
    rows: str = setting("all", "of the log, or those where the way turns", words=("all", "peaks"))
    clock: str = setting("yes", "whether the log has a time", words=("yes", "no"))
    load: float = setting(0.0, "normal force N, of which the law is; 0: not recorded", "N", least=0.0)
    load_steps: float = setting(0.0, "by how much N steps each cycle, of N", "1", least=0.0)
    warming: float = setting(0.0, "rise of the temperature within the log, which is recorded then", "K")
    softening: float = setting(0.0, "change of the law with the temperature", "1/K")
    saturated: float = setting(0.0, "damping that saturates", "N")
    width: float = setting(0.01, "speed at which it does", "m/s", least=1e-12)
    viscous: float = setting(0.0, "viscous damping", "N s/m")
    inertia: float = setting(0.0, "mass of the rod", "kg")
    noise_way: float = setting(0.0, "rms, of the range", "1", least=0.0)
    noise_force: float = setting(0.0, "rms, of the range", "1", least=0.0)
    step_way: float = setting(0.0, "of the reading", "m", least=0.0)
    step_force: float = setting(0.0, "of the reading", "N", least=0.0)
    sign: float = setting(1.0, "-1: the force is turned", "1")
    unit_way: str = setting("m", "in which it is written: mm, in")
    unit_force: str = setting("N", "in which it is written: kN, lbf")
    offset: float = setting(0.0, "of the load cell", "N")
    frame: float = setting(0.0, "stiffness of the frame in series, within what x shows; 0: rigid", "N/m", least=0.0)
    backlash: float = setting(0.0, "to either side, of the grips", "m", least=0.0)
    lag: float = setting(0.0, "of the force behind the way", "s")
    drift: float = setting(0.0, "of the load cell over the log", "N")
    wear: float = setting(0.0, "share of the force that is lost over the log", "1")
    one_sided: float = setting(0.0, "share by which a positive force is larger", "1")
    cubic: float = setting(0.0, "spring beside", "N/m^3")

    def __post_init__(self) -> None:
        """Raises StickslipError: a setting out of its range."""
        check_settings(self)
        if self.cut >= self.cycles / self.rate:
            raise StickslipError(f"A log that begins at {self.cut:g} s has nothing of {self.cycles / self.rate:g} s.")


def record_loop(bench: JointBench, name: str = "loop", seed: int = 0, number: int = 0) -> Recorded:
    """A log of force over way. seed: of the bench; number: of the log on it.

    Raises:
        StickslipError: a law that is none, or a unit.
    """
    rng = np.random.default_rng([seed, number])
    dense = max(int(np.ceil(FINE * bench.rate / bench.sampling_rate)), 1)
    count = int(np.floor(bench.cycles / bench.rate * bench.sampling_rate + 1e-9)) * dense
    time = np.arange(count + 1) / (bench.sampling_rate * dense)
    y = bench.amplitude * WAYS[bench.programme](2 * np.pi * bench.rate * time, rng)
    force, beside = _force(bench, time, y, rng)
    way = y + (force / bench.frame if bench.frame else 0.0)
    way = way + bench.backlash * np.clip(force / (SETTLED * np.abs(force).max()), -1, 1)
    seen = np.interp(time - bench.lag, time, force) + bench.offset + bench.drift * time / time[-1]
    chosen = slice(int(np.ceil(bench.cut * bench.sampling_rate)) * dense, None, dense)
    columns = {"time": time, "way": way, "force": seen, **beside}
    columns = {role: column[chosen] for role, column in columns.items()}
    for role in ("way", "force"):
        noise, step = getattr(bench, f"noise_{role}"), getattr(bench, f"step_{role}")
        columns[role] = columns[role] + noise * np.ptp(columns[role]) * rng.standard_normal(len(columns[role]))
        columns[role] = np.round(columns[role] / step) * step if step else columns[role]
    columns["force"] = columns["force"] * np.sign(bench.sign)
    units = {"time": "s", "way": bench.unit_way, "force": bench.unit_force, "load": "N", "temperature": "degC"}
    for role, unit in (("way", "m"), ("force", "N")):
        columns[role] = columns[role] / conversion(units[role], unit, f"'unit_{role}'")
    if bench.rows == "peaks":
        turns = np.flatnonzero(np.diff(np.sign(np.diff(columns["way"]))) != 0) + 1
        columns = {role: column[turns] for role, column in columns.items()}
    if bench.clock == "no":
        del columns["time"]
    return Recorded(name, columns, {role: units[role] for role in columns}, {"seed": seed, **asdict(bench)})


def law_of(text: str) -> Any:
    """A law from a text such as "Play(Dahl(sigma=2e6, F_c=50), w=1e-3)".

    Raises:
        StickslipError: it is none.
    """
    known = {law.__name__: law for law in LAWS}

    def part(node: ast.expr) -> Any:
        if isinstance(node, ast.List | ast.Tuple):
            return [part(inner) for inner in node.elts]
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in known):
            return float(ast.literal_eval(node))  # of a whole number the unit would be 1
        law = known[node.func.id]
        whole = {entry.name for entry in fields(law) if isinstance(entry.default, int)}
        named = {word.arg or "": part(word.value) for word in node.keywords}
        return law(*map(part, node.args), **{n: int(v) if n in whole else v for n, v in named.items()})

    try:
        return part(ast.parse(text, mode="eval").body)
    except (SyntaxError, ValueError, TypeError) as error:
        raise StickslipError(
            f"'{text}' is no law ({error}). Write one of {', '.join(known)} with numbers in SI, such as "
            "Dahl(sigma=2e6, F_c=50)."
        ) from error


def _force(
    bench: JointBench, time: np.ndarray, y: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Of the joint and its rod (n,), N, and what is recorded beside."""
    speed = np.gradient(y, time)
    gone = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(y)))])
    steps = 1 + bench.load_steps * rng.uniform(-1, 1, int(np.ceil(bench.cycles)) + 1)
    normal = steps[(time * bench.rate).astype(int)]
    warmer = bench.warming * (1 - np.exp(-3 * time / time[-1]))
    factor = normal * (1 + bench.softening * warmer) * (1 - bench.wear * gone / gone[-1])
    run = simulate(_joint(bench.law), float(time[-1]), inputs={"way": Signal(time, y)}, output_times=time)
    damped = bench.saturated * np.tanh(speed / bench.width) + bench.viscous * speed
    force = factor * (run["force"] + damped)
    force = force * (1 + bench.one_sided * (force > 0)) + bench.cubic * y**3 + bench.inertia * np.gradient(speed, time)
    beside = {"load": bench.load * normal} if bench.load else {}
    return force, beside | ({"temperature": ROOM + warmer} if bench.warming else {})


@cache
def _joint(law: str) -> Fmu:
    """A joint of a law along a way that an input prescribes."""
    way = Input("way", 0.0, "m", "displacement")
    rest = Coordinate("rest", "m", "a body that nothing moves", velocity="rest_speed")
    mass = Parameter("rest_mass", 1.0, "kg", "mass of the body that nothing moves", positive=True)
    held = Hysteresis(name="h", way=way, law=law_of(law))
    joint = Mechanism(
        name="joint_on_bench",
        title="Joint that a bench moves",
        source="rig_io.bench.joint",
        coordinates=[rest],
        kinetic_energy=mass * rest.v**2 / 2,
        contacts=[held],
        outputs=[Output("force", held.force, "N", "force that resists the way")],
    )
    return load(joint)


def _random(phase: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A dozen sines of up to 1.4 times the rate, from rest."""
    rates, begins = rng.uniform(0.3, 1.4, 12), rng.uniform(0, 2 * np.pi, 12)
    way = np.sin(phase[:, None] * rates + begins).sum(axis=1) - np.sin(begins).sum()
    return way / np.abs(way).max()
