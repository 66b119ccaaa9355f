"""Drive speeds at which stick appears or disappears: predicted by a model, and read from a family of logs.

Predicted: the speed is raised in steps, each run from where the one before ended, as at the bench; where the set of
sticking discs changes, the speed is halved in between. With one disc there are two answers:
    Hopf   c + sum_i R^2 N_i mu_i'(|v_i|) = 0     above it steady sliding is stable (found from the model's equations)
    fold   the cycle with stick is gone above it; between the two both exist, and the start decides
Measured: a bracket, from the last speed with stick to the first without. At the fold the cycle grazes the stick line,
so that the angle turned through in stick vanishes as the square root of the distance: its square, a parabola through
the three fastest logs with stick, is carried on to zero. How long a disc sticks, from the time its slip speed is below
a threshold: `identification.model_check.portraits.Stick`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fmu_models.base.errors import StickslipError
from fmu_models.base.record import Recorded
from fmu_models.simulation.trajectory import Event
from identification.fit.result import FrictionFit
from identification.fitted_model.model import FittedModel, fmu_parameters
from identification.model_check.portraits import Stick

STEPS = 24  # of a sweep over the speeds of a family
BISECTIONS = 40
TOGETHER = 1e-6  # relative distance up to which two transitions are one
WATCH = 10.0  # natural periods, in which a disc must stick to count as sticking
SETTLE = 20.0  # natural periods before: a cycle with stick is reached at its first stick
BEYOND = 1.15  # by which the speed is raised at a time, where stick outlasts the speeds of the family
FASTEST = 100.0  # rad/s
MICRO_SLIP = 1e-3  # m/s, slip speed of a law with bristles that counts as stick
STEP = 1e-3  # relative, for derivatives by parameters
NEAR_ENOUGH = 1e-6  # relative, of a transition of moved parameters: derivatives to 1e-3
FORM = 0.1  # of the way from the last log with stick to where stick is to vanish: error of the parabola, assumed
VAGUE = 0.25  # relative deviation from which on an extrapolation, or an agreement, says nothing
LEAST = 3  # logs with stick for an extrapolation
COVER = 1.96  # standard deviations


@dataclass(frozen=True)
class Transition:
    """A drive speed (rad/s, of ``varied``) where the sticking discs change, as it rises, and its standard deviations
    from the noise in the fitted parameters and from the constants of the rig (NaN where not asked for); at_least:
    whether nobody says how well one of these is known."""

    RECORD = ("varied", "speed", "before", "after", "noise_deviation", "scale_deviation", "at_least", "words")

    varied: str
    speed: float
    before: tuple[str, ...]
    after: tuple[str, ...]
    noise_deviation: float = float("nan")
    scale_deviation: float = float("nan")
    at_least: bool = False

    @property
    def deviation(self) -> float:
        """Standard deviation from both, rad/s."""
        return float(np.hypot(self.noise_deviation, self.scale_deviation))

    @property
    def words(self) -> str:
        """The change in words."""
        gone = [contact for contact in self.before if contact not in self.after]
        new = [contact for contact in self.after if contact not in self.before]
        clauses = [f"stick on {' and '.join(gone)} disappears"] if gone else []
        return ", ".join(clauses + ([f"stick on {' and '.join(new)} appears"] if new else []))


@dataclass(frozen=True)
class MeasuredBifurcation:
    """What a family of logs says. before, after: sticking discs below and above; low, high: rad/s, last speed of the
    one and first of the other (high infinite: no log without stick); estimate: rad/s, carried on to zero stick, with
    its standard deviation from noise and from the curvature of the curve (None: not to be had)."""

    varied: str
    low: float
    high: float
    before: tuple[str, ...]
    after: tuple[str, ...]
    estimate: float | None = None
    deviation: float | None = None


@dataclass(frozen=True)
class BifurcationComparison(Recorded):
    """Measured against predicted. alike: rad/s, what the model's own motions at the speeds of the logs give by the same
    road as the measured estimate; passed: the prediction and the bracket overlap (None: nothing to judge, or both are
    known too vaguely)."""

    measured: MeasuredBifurcation | None
    predicted: Transition | None
    alike: float | None
    passed: bool | None


def sticking(
    model: FittedModel, drive_speeds: Mapping[str, float], start: Mapping[str, float] | None = None
) -> tuple[tuple[str, ...], Mapping[str, float]]:
    """The discs that stick in the motion that a run ends in, and states of it to start the next run from: in stick, if
    there is stick, since the motion that lets go there is the outermost and finds the cycle if there is one."""
    if not model.sticks:
        return _creeping(model, drive_speeds, start)
    until = (SETTLE + WATCH) * model.natural_period
    end, events = model.states_at(drive_speeds, until, start)
    discs = _settled_sticks(model, end, events)
    lands = [event.time for event in events if event.after == 0]
    if discs and lands:
        end, _ = model.states_at(drive_speeds, lands[-1], start)
    return discs, {name: end[name] for name in model.fmu.states}


def stuck(model: FittedModel, drive_speeds: Mapping[str, float], start: Mapping[str, float]) -> tuple[str, ...]:
    """The discs alone of `sticking`."""
    if not model.sticks:
        return _creeping(model, drive_speeds, start)[0]
    return _settled_sticks(model, *model.states_at(drive_speeds, (SETTLE + WATCH) * model.natural_period, start))


def _settled_sticks(model: FittedModel, end: Mapping[str, float], events: Sequence[Event]) -> tuple[str, ...]:
    """The discs that stick once the motion has settled."""
    sticks = {event.contact for event in events if event.time > SETTLE * model.natural_period and event.after == 0}
    sticks |= {contact for contact in model.contacts if end[f"{contact}_state"] == 0}
    return tuple(contact for contact in model.contacts if contact in sticks)


def _creeping(
    model: FittedModel, drive_speeds: Mapping[str, float], start: Mapping[str, float] | None
) -> tuple[tuple[str, ...], Mapping[str, float]]:
    """As `sticking`, for a law with bristles, which never sticks exactly."""
    span = WATCH * model.natural_period
    run = model.run(drive_speeds, span, span / 4000, transient=SETTLE, start=start)
    r, R = model.parameters["r"], model.parameters["R"]
    slip = {contact: r * speed - R * run.speed for contact, speed in drive_speeds.items()}
    discs = tuple(contact for contact in model.contacts if np.abs(slip[contact]).min() < MICRO_SLIP)
    return discs, run.end


def transitions(
    model: FittedModel, varied: str, fixed: Mapping[str, float], low: float, high: float, *, beyond: bool = False
) -> tuple[Transition, ...]:
    """Where the set of sticking discs changes as a drive speed rises from ``low`` to ``high``.

    varied: the disc whose speed rises, rad/s; fixed: speeds of the others; beyond: go on until no disc sticks.
    StickslipError: a range without extent.
    """
    if not 0 < abs(low) < abs(high):
        raise StickslipError(f"The drive speed must rise from one above zero, found {low:g} to {high:g} rad/s.")
    speeds = np.linspace(low, high, STEPS + 1).tolist()
    discs, state = sticking(model, {**fixed, varied: low})
    changes, speed = [], low
    while discs or speeds[1:]:
        speeds = speeds[1:]
        if not speeds and not (beyond and abs(speed) < FASTEST):
            break
        after = speeds[0] if speeds else speed * BEYOND
        others, end = sticking(model, {**fixed, varied: after}, _taken(model, state, discs, varied, speed, after))
        if others != discs:
            changes += _between(model, varied, fixed, (speed, discs, state), (after, others))
        speed, discs, state = after, others, end
    return tuple(_merged(changes))


def _merged(changes: Sequence[Transition]) -> list[Transition]:
    """Changes at one speed are one: where both discs turn alike, both stick at that speed alone."""
    merged: list[Transition] = []
    for change in changes:
        if merged and abs(change.speed - merged[-1].speed) < TOGETHER * abs(change.speed):
            merged[-1] = replace(merged[-1], after=change.after)
        else:
            merged.append(change)
    return [change for change in merged if change.before != change.after]


def _between(
    model: FittedModel,
    varied: str,
    fixed: Mapping[str, float],
    before: tuple[float, tuple[str, ...], Mapping[str, float]],
    after: tuple[float, tuple[str, ...]],
) -> list[Transition]:
    """The transitions between two speeds, found by halving; one set of discs after the other."""
    (low, discs, state), (high, others) = before, after
    seen = others
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        inner, end = sticking(model, {**fixed, varied: middle}, _taken(model, state, discs, varied, low, middle))
        if inner == discs:
            low, state = middle, end
        else:
            high, seen = middle, inner
    first = Transition(varied, 0.5 * (low + high), discs, seen)
    if seen == others or abs(after[0] - high) < 1e-9:
        return [first]
    _, start = sticking(model, {**fixed, varied: high}, _taken(model, state, discs, varied, low, high))
    return [first, *_between(model, varied, fixed, (high, seen, start), after)]


def _taken(
    model: FittedModel, state: Mapping[str, float], discs: tuple[str, ...], varied: str, speed: float, after: float
) -> Mapping[str, float]:
    """States to start from at another drive speed: a body that sticks to the disc is taken along by it."""
    p = model.parameters
    grip = p["r"] * speed / p["R"]
    if varied in discs and abs(state["omega"] - grip) < 1e-6 * abs(grip):
        return {**state, "omega": p["r"] * after / p["R"]}
    return state


def hopf_speed(model: FittedModel, varied: str, fixed: Mapping[str, float], low: float, high: float) -> float | None:
    """Greatest speed (rad/s, of ``varied``) in a range at which steady sliding changes its stability, or None."""
    from scipy.optimize import brentq

    def damping(speed: float) -> float:
        sliding = model.sliding({**fixed, varied: speed})
        return float("nan") if sliding is None else sliding.damping

    speeds = np.linspace(high, low, STEPS + 1)
    above = damping(float(speeds[0]))
    for last, speed in pairwise(speeds):
        current = damping(float(speed))
        if above * current < 0:
            return float(brentq(damping, float(speed), float(last), xtol=1e-10))  # type: ignore[arg-type]
        above = current
    return None


def deviations(fit: FrictionFit, value: Callable[[FrictionFit], float]) -> tuple[float, float]:
    """Standard deviations of what follows from a fit: from the noise in its parameters, and from the constants of the
    rig, which move the parameters too."""
    sd = np.array([q.standard_deviation for q in fit.parameters])
    gradient = np.array(
        [
            (value(_moved(fit, {q.name: STEP})) - value(_moved(fit, {q.name: -STEP}))) / (2 * STEP * q.value)
            if q.value and q.standard_deviation
            else 0.0
            for q in fit.parameters
        ]
    )
    noise = float(np.sqrt(max((gradient * sd) @ np.array(fit.correlation) @ (gradient * sd), 0.0)))
    moves = np.zeros(len(fit.constants))
    for index, constant in enumerate(fit.constants):
        if not constant.standard_uncertainty or not constant.value:
            continue
        share = {name: s for name, s in constant.sensitivity.items() if s is not None}
        up, down = (
            value(_moved(fit, {n: sign * STEP * s for n, s in share.items()}, {constant.name: sign * STEP}))
            for sign in (1.0, -1.0)
        )
        moves[index] = (up - down) / (2 * STEP) * constant.standard_uncertainty / constant.value
    return noise, float(np.sqrt(max(moves @ fit.correlation_of_constants @ moves, 0.0)))


def _moved(
    fit: FrictionFit, parameters: Mapping[str, float], constants: Mapping[str, float] | None = None
) -> FrictionFit:
    """A fit with parameters and constants larger by these shares."""
    return replace(
        fit,
        parameters=tuple(replace(q, value=q.value * (1 + parameters.get(q.name, 0.0))) for q in fit.parameters),
        constants=tuple(replace(q, value=q.value * (1 + (constants or {}).get(q.name, 0.0))) for q in fit.constants),
    )


def with_uncertainty(fit: FrictionFit, model: FittedModel, point: Transition, fixed: Mapping[str, float]) -> Transition:
    """A predicted transition with what the fit leaves open about it; without, where that cannot be followed."""
    reach = 5 * STEP * point.speed

    def relocated(moved: FrictionFit) -> float:
        return _located(model.with_parameters(fmu_parameters(moved)), point, fixed, reach)

    try:
        noise, scale = deviations(fit, relocated)
    except StickslipError:
        return point
    at_least = not all(constant.stated for constant in fit.constants)
    return replace(point, noise_deviation=noise, scale_deviation=scale, at_least=at_least)


def _located(model: FittedModel, point: Transition, fixed: Mapping[str, float], reach: float) -> float:
    """The speed of a transition near a known one."""
    low, high = point.speed - reach, point.speed + reach

    def remains(speed: float) -> bool:
        start = _taken(model, state, point.before, point.varied, lower, speed)
        return stuck(model, {**fixed, point.varied: speed}, start) == point.before

    for _ in range(6):
        lower = low
        discs, state = sticking(model, {**fixed, point.varied: low})
        if discs == point.before and not remains(high):
            break
        low, high = low - reach, high + reach
        reach *= 2
    else:
        raise StickslipError(
            f"The transition near {point.speed:.4g} rad/s is lost when the parameters change a little."
        )
    while high - low > NEAR_ENOUGH * point.speed:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if remains(middle) else (low, middle)
    return 0.5 * (low + high)


def stick_angle(stick: Stick, drive_speed: float) -> tuple[float, float]:
    """Square of the angle (rad^2) that the drive turns through in a stick, with the standard deviation of its mean over
    the sticks of a log."""
    squares = drive_speed**2 * stick.squares
    spread = float(np.std(squares, ddof=1) / np.sqrt(len(squares))) if len(squares) > 1 else float("nan")
    return float(np.mean(squares)) if len(squares) else float("nan"), spread


def extrapolated(
    speeds: Sequence[float] | np.ndarray,
    squares: Sequence[float] | np.ndarray,
    deviations: Sequence[float] | np.ndarray,
) -> tuple[float, float] | None:
    """Speed (rad/s) at which the square of the stick angle vanishes, from three logs or more, and its standard
    deviation; None where it does not fall towards zero, or not clearly.

    The parabola through the last three is held against A w (w_0 - w) through the last two: their difference, and a
    share of the way carried on, stand for what the form of the curve leaves open.
    """
    order = np.argsort(speeds)[-LEAST:]
    w, y, sd = (np.asarray(values, dtype=float)[order] for values in (speeds, squares, deviations))
    if len(w) < LEAST or not np.all(np.isfinite(y)):
        return None
    root = _parabola_root(w, y)
    ratio = y[-2:] / w[-2:]
    slope = (ratio[1] - ratio[0]) / (w[-1] - w[-2])
    if root is None or slope >= 0:
        return None
    second = w[-1] - ratio[1] / slope
    power = (root - second) ** 2 + (FORM * (root - w[-1])) ** 2
    for i in range(LEAST):
        if np.isfinite(sd[i]):
            moved = y.copy()
            moved[i] += sd[i]
            shifted = _parabola_root(w, moved)
            power += (shifted - root) ** 2 if shifted is not None else root**2
    deviation = float(np.sqrt(power))
    return (root, deviation) if deviation < VAGUE * root else None


def _parabola_root(w: np.ndarray, y: np.ndarray) -> float | None:
    """First zero above the last of three speeds."""
    roots = np.roots(np.polyfit(w, y, 2))
    above = [float(x.real) for x in roots if abs(x.imag) < 1e-12 and x.real > w[-1]]
    return min(above) if above else None
