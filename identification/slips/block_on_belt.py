"""A block on a belt, fitted to slip statistics and compared with them.

Phases of irregular stick-slip cannot be compared, statistics can. The FMU of ``block_on_belt`` is run with the slider's
mass, spring and speed; its mu_s and mu_k are moved until peak and after-slip value, found in its friction by the very
detector that found them in the log, are the measured ones. Period, slip time and loading are then predictions. Friction
falls from mu_s to mu_k within a small part of the greatest slip speed,
    v_max = (mu_s - mu_k) g sqrt(m/k),    1/p = v_max/STEEP,
since statistics say nothing of the fall's shape.
"""

from dataclasses import dataclass

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.record import Recorded
from identification.measurement.signals import GRAVITY
from identification.slips.events import find_slips
from identification.slips.statistics import SlipStatistics, natural_period, swings

STEEP = 200.0  # slip speeds 1/p in v_max
CYCLES = 6
TRANSIENT = 2  # cycles
ACCURACY = 1e-4  # relative, of peak and after-slip value
ITERATIONS = 12
REPEATS = 0.01  # of the period and of a drop: slips that vary less are called alike
SAMPLES = 200  # per natural period: the smoothing's window holds 20
MOST = 20_000_000  # samples of a run: more do not fit into the memory
NEEDED = ("mass", "stiffness", "speed")


@dataclass(frozen=True)
class Prediction:
    """One statistic, measured and modelled; ``fitted``: the model was made to have it; ``inside``: the model's lies in
    the 95 % interval of the measured one."""

    name: str
    unit: str
    measured: float
    modelled: float
    fitted: bool
    inside: bool

    @property
    def ratio(self) -> float:
        """Modelled over measured."""
        return self.modelled / self.measured


@dataclass(frozen=True)
class SlipModel(Recorded):
    """The fitted model: friction coefficients, steepness p (s/m, assumed), its statistics beside the measured ones."""

    mu_s: float
    mu_k: float
    p: float
    predictions: tuple[Prediction, ...]
    verdict: str


@dataclass(frozen=True)
class _Cycle:
    """Statistics of a simulated motion."""

    peak: float
    after: float
    period: float
    slip_time: float


def fit_slip_model(statistics: SlipStatistics) -> SlipModel | None:
    """Fit the block on a belt; None where mass, stiffness or speed is unknown. StickslipError: no friction coefficients
    give the measured peak and after-slip value, or the slider swings instead of sticking."""
    if any(name not in statistics.known for name in NEEDED):
        return None
    if swings(statistics.known, statistics.period):
        raise StickslipError(
            f"Slips come every {statistics.period.value:.4g} s, as fast as the slider swings on its spring (natural "
            f"period {natural_period(statistics.known):.4g} s): peaks of a swing are not static friction, and no law "
            "of friction is fitted to them."
        )
    target = np.array([statistics.peak.value, statistics.after.value])
    if target[0] <= 0:
        raise StickslipError(
            f"The friction of the log is negative ({target[0]:.4g} at its peaks), and that of a law is not. If the "
            "sensor counts the other way, write gain = -1 into the recipe's signal."
        )
    # a steep fall without damping overshoots as far as it fell: the middle is mu_k
    guess = np.array([target[0], target.mean()])
    p = STEEP / ((guess[0] - guess[1]) * GRAVITY * np.sqrt(statistics.known["mass"] / statistics.known["stiffness"]))
    block = _Block(statistics, float(p))
    nearest, best = np.inf, None
    for _ in range(ITERATIONS):
        if np.min(guess) <= 0:
            break
        cycle = block.cycle(float(guess[0]), float(guess[1]))
        miss = np.array([cycle.peak, cycle.after]) - target
        if (error := float(np.max(np.abs(miss)))) < nearest:
            nearest, best = error, (guess, cycle)
        if nearest <= ACCURACY * target[0]:
            break
        # d peak/d mu_s = 1, d after/d (mu_s, mu_k) = (-1, 2) for the steep fall
        guess = guess - np.array([miss[0], (miss[1] + miss[0]) / 2])
    # peaks fall on samples: what they jump by as the coefficients move may be more than the accuracy
    if best is not None and nearest <= max(ACCURACY * target[0], block.resolution):
        return _compared(statistics, best[0], float(p), best[1])
    raise StickslipError(
        f"No friction coefficients give the block on a belt a peak of {target[0]:.4g} and {target[1]:.4g} after it at "
        f"{statistics.known['speed']:g} m/s (last tried mu_s = {guess[0]:.4g}, mu_k = {guess[1]:.4g}): at this speed "
        "the friction of one law does not stick and slip. Look at the verdicts on the log."
    )


class _Block:
    """The FMU of the block on a belt with the slider's constants."""

    def __init__(self, statistics: SlipStatistics, p: float) -> None:
        from fmu_models.codegen.package import built
        from fmu_models.fmu.fmu import Fmu

        rig = statistics.known
        self.fmu = Fmu.open(built("block_on_belt"))
        self.weight = rig["mass"] * GRAVITY
        self.rig, self.p = rig, p
        self.natural_period = natural_period(rig)
        self.step = self.natural_period / SAMPLES
        self.window = statistics.smoothed
        self.length = CYCLES * statistics.period.value
        if self.length > MOST * self.step:
            raise StickslipError(
                f"Slips come every {statistics.period.value:.4g} s and the natural period is {self.natural_period:.4g} "
                "s: too much stick to be simulated. Is a mass or stiffness that of this log?"
            )

    @property
    def resolution(self) -> float:
        """The change of friction from a sample to the next."""
        return self.rig["stiffness"] * self.rig["speed"] / self.weight * self.step

    def cycle(self, mu_s: float, mu_k: float) -> _Cycle:
        """Statistics of the motion after a transient; friction is read from the spring, as in the log."""
        from fmu_models.simulation.run import simulate

        rig = self.rig
        parameters = {
            "m": rig["mass"],
            "k": rig["stiffness"],
            "c": rig.get("damping", 0.0),
            "N": self.weight,
            "mu_s": mu_s,
            "mu_k": mu_k,
            "p": self.p,
        }
        stretch = mu_k * self.weight / rig["stiffness"]
        time = np.arange(0.0, self.length + TRANSIENT * self.natural_period, self.step)
        run = simulate(
            self.fmu,
            time[-1],
            output_times=time,
            parameters=parameters,
            inputs={"v_belt": rig["speed"]},
            start={"x": stretch, "v": rig["speed"]},
        )
        friction = run["x"] * rig["stiffness"] / self.weight
        slips = find_slips([(run.time, friction)], self.step, self.window)
        if len(slips.time) < TRANSIENT + 1:
            raise StickslipError(
                f"With mu_s = {mu_s:.4g} and mu_k = {mu_k:.4g} the block on a belt shows {len(slips.time)} slips in "
                f"{self.length:.3g} s, the log {CYCLES}: at {rig['speed']:g} m/s it slides steadily, or sticks. The "
                "log's slips are not those of one friction law with this spring and speed."
            )
        return _Cycle(
            float(np.median(slips.peak[1:])),
            float(np.median(slips.after[1:])),
            float(np.mean(slips.interval[2:])) if len(slips.time) > TRANSIENT else float("nan"),
            float(np.median(slips.duration[1:])),
        )


def _compared(statistics: SlipStatistics, mu: np.ndarray, p: float, cycle: _Cycle) -> SlipModel:
    rows = (
        ("peak friction", "1", statistics.peak, cycle.peak, True),
        ("friction after slip", "1", statistics.after, cycle.after, True),
        ("period", "s", statistics.period, cycle.period, False),
        ("slip time", "s", statistics.slip_time, cycle.slip_time, False),
    )
    predictions = tuple(
        Prediction(name, unit, measured.value, modelled, fitted, measured.low <= modelled <= measured.high)
        for name, unit, measured, modelled, fitted in rows
    )
    return SlipModel(float(mu[0]), float(mu[1]), p, predictions, _verdict(statistics, predictions[2]))


def _verdict(statistics: SlipStatistics, period: Prediction) -> str:
    side = "inside" if period.inside else "outside"
    sentence = (
        f"The model's period is {period.modelled:.4g} s, {side} the 95 % interval of the measured mean "
        f"{statistics.period.low:.4g} .. {statistics.period.high:.4g} s."
    )
    spread = statistics.peak.spread / statistics.drop.value
    periods = f"measured periods vary by {100 * statistics.period_variation:.2g} %"
    varies = f"{periods} and peaks by {100 * spread:.2g} % of a drop"
    # noise moves a peak, and by its peak a period, as far as it goes itself
    if max(statistics.period_variation, spread) <= max(REPEATS, statistics.noise / statistics.drop.value):
        return f"{sentence} One law repeats itself, and so do these slips: {varies}."
    return f"{sentence} One law repeats itself; {varies}, which no law of slip speed alone explains."
