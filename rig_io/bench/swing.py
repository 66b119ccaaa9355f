"""A bench that lets an oscillator swing to rest, and what its sensor shows of the angle.

    q'' + w0^2 back(q) + cubic q^3 + sgn(q') (f (1 + uneven sin(8 q)) (1 + breakaway e^(-|q'|/speed)) + c |q'| + b q'^2)
        = draft(t),    back(q) = q or sin q
    shown:  q + eccentric sin(q + 1/2) + zero + drift t/t(end) + noise

Each run begins with a hand that leads the angle from where it rests: a resonance that grows over ``driven`` s, or a
turn to the amplitude that is let go. What stands below ``cubic`` in the settings is known to no estimator.
"""

from dataclasses import asdict, dataclass

import numpy as np
import sympy

from fmu_models.base.unit_names import conversion
from fmu_models.fmu.load import load
from fmu_models.language.dry_friction import DryFriction
from fmu_models.language.friction import Friction
from fmu_models.language.mechanism import Mechanism
from fmu_models.language.quantities import Coordinate, Input, Parameter
from fmu_models.simulation.run import simulate
from fmu_models.simulation.signal import Signal
from rig_io.bench.settings import Recorded, check_settings, setting

FINE = 200  # samples of the truth in a cycle, at least
HAND = 1.0  # s in which a hand turns the angle
TURNS, DRAFT = 8, (0.02, 0.4)  # of the friction in a revolution; Hz
_LAW = ("w0", "f", "c", "b", "cubic", "breakaway", "speed", "uneven")


@dataclass(frozen=True)
class SwingBench:
    """A bench for decays, see the module."""

    kind: str = setting("spring", "what brings it back", words=("spring", "gravity"))
    w0: float = setting(5.0, "natural frequency", "rad/s", least=1e-9)
    f: float = setting(0.12, "dry friction over inertia", "1/s^2", least=0.0)
    c: float = setting(0.06, "viscous friction over inertia", "1/s", least=0.0)
    b: float = setting(0.04, "quadratic friction over inertia", "1", least=0.0)
    amplitude: float = setting(0.8, "at which it is let go", "rad", least=1e-9)
    driven: float = setting(0.0, "of a run that begins with a resonance; 0: let go", "s", least=0.0)
    runs: float = setting(1.0, "in a log, one after the other", "1", least=1.0)
    duration: float = setting(25.0, "of a run", "s", least=1e-3)
    sampling_rate: float = setting(100.0, "of the log", "Hz", least=1e-3)
    jitter: float = setting(0.0, "of the times of samples, of their distance", "1", least=0.0)
    lost: float = setting(0.0, "share of the samples that is missing", "1", least=0.0)
    cut: float = setting(0.0, "when the log begins", "s", least=0.0)
    noise: float = setting(0.0, "rms", "rad", least=0.0)
    step: float = setting(0.0, "of the reading", "rad", least=0.0)
    zero: float = setting(0.0, "reading at rest", "rad")
    unit: str = setting("rad", "in which the angle is written: deg")
    cubic: float = setting(0.0, "spring beside, over inertia", "1/s^2")
    breakaway: float = setting(0.0, "share by which dry friction is larger at rest", "1")
    speed: float = setting(0.05, "over which that is lost", "rad/s", least=1e-9)
    uneven: float = setting(0.0, "share by which dry friction changes with the angle", "1")
    draft: float = setting(0.0, "rms of a slow push, over inertia", "1/s^2", least=0.0)
    eccentric: float = setting(0.0, "error of the encoder once a revolution", "rad")
    drift: float = setting(0.0, "of the reading over the log", "rad")

    def __post_init__(self) -> None:
        """Raises StickslipError: a setting out of its range."""
        check_settings(self)


@dataclass(frozen=True)
class _Drag(DryFriction):
    """Dry friction ``dry``, in parts of which it is larger at rest, viscous and quadratic."""

    dry: sympy.Expr
    c: sympy.Expr
    b: sympy.Expr
    breakaway: sympy.Expr
    width: sympy.Expr

    def magnitude(self, speed: sympy.Expr) -> sympy.Expr:
        risen = 1 + self.breakaway * sympy.exp(-speed / self.width)
        return self.dry * risen + self.c * speed + self.b * speed**2


def swing_model(*, gravity: bool) -> Mechanism:
    """The oscillator on its bench, of inertia 1."""
    units = ("rad/s", "N m", "N m s", "N m s2", "N m", "1", "rad/s", "1")
    w0, f, c, b, cubic, breakaway, speed, uneven = (
        Parameter(name, 1.0, unit, f"{name} of the bench") for name, unit in zip(_LAW, units, strict=True)
    )
    J = Parameter("J", 1.0, "kg m2", "moment of inertia", positive=True)
    push = Input("push", 0.0, "N m", "of a draft")
    q = Coordinate("angle", "rad", "angle", velocity="speed_of_angle")
    law = _Drag(f * (1 + uneven * sympy.sin(TURNS * q)), c, b, breakaway, speed)
    back = 1 - sympy.cos(q) if gravity else q**2 / 2
    return Mechanism(
        name=f"swing_on_bench_{'gravity' if gravity else 'spring'}",
        title="Oscillator that a bench lets go",
        source="rig_io.bench.swing",
        coordinates=[q],
        kinetic_energy=J * q.v**2 / 2,
        potential_energy=J * w0**2 * back + cubic * q**4 / 4,
        applied={q: push},
        contacts=[Friction(name="bearing", slip=q.v, law=law)],
    )


def record_decay(bench: SwingBench, name: str = "decay", seed: int = 0, number: int = 0) -> Recorded:
    """A log of an angle over time. seed: of the bench; number: of the log on it.

    Raises:
        StickslipError: a unit that does not fit.
    """
    rng = np.random.default_rng([seed, number])
    fmu, parameters = load(swing_model(gravity=bench.kind == "gravity")), {n: getattr(bench, n) for n in _LAW}
    rate = max(bench.sampling_rate, FINE * bench.w0 / (2 * np.pi))
    led, free = (np.arange(0.0, end, 1 / rate) for end in (bench.driven or HAND, bench.duration))
    rest, angles = bench.amplitude if not bench.driven else 0.0, []
    for run in range(int(bench.runs)):
        share = led / (bench.driven or HAND)
        swung = bench.amplitude * share * np.sin(bench.w0 * led)
        turned = rest + (bench.amplitude - rest) * (3 - 2 * share) * share**2
        hand = rest * (1 - share) + swung if bench.driven else turned
        let_go = float(np.gradient(hand, led)[-1]) if bench.driven else 0.0
        rates, begins = rng.uniform(*DRAFT, 8), rng.uniform(0, 2 * np.pi, 8)
        push = bench.draft / 2 * np.sin(2 * np.pi * np.outer(free, rates) + begins).sum(axis=1)
        moved = simulate(
            fmu,
            float(free[-1]),
            parameters=parameters,
            start={"angle": float(hand[-1]), "speed_of_angle": let_go},
            inputs={"push": Signal(free, push)},
            output_times=free,
        )["angle"]
        angles += ([] if run == 0 and not bench.driven else [hand]) + [moved]
        rest = float(moved[-1])
    q = np.concatenate(angles)
    time = np.arange(len(q)) / rate
    shown = q + bench.eccentric * np.sin(q + 0.5) + bench.zero + bench.drift * time / time[-1]
    ticks = np.arange(bench.cut, time[-1], 1 / bench.sampling_rate)
    ticks = ticks + bench.jitter / bench.sampling_rate * rng.uniform(-0.5, 0.5, len(ticks))
    ticks = np.sort(ticks[rng.uniform(size=len(ticks)) >= bench.lost])
    seen = np.interp(ticks, time, shown) + bench.noise * rng.standard_normal(len(ticks))
    seen = np.round(seen / bench.step) * bench.step if bench.step else seen
    columns = {"time": ticks - ticks[0], "angle": seen / conversion(bench.unit, "rad", "'unit'")}
    return Recorded(name, columns, {"time": "s", "angle": bench.unit}, {"seed": seed, **asdict(bench)})
