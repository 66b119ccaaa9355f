"""What slips say at a guess: residuals, and their derivatives by all that is sought.

Theta follows a small torque f as  Phi int Phi^-1 (0, f) dt,  Phi the motion's fundamental matrix.
"""

from collections.abc import Callable, Mapping

import numpy as np

from identification.disturbances.term import DAMPING, DRIVE, FRICTION, SPRING
from identification.estimators.shooting_segments import LINE
from identification.free_friction.guess import AHEAD, MODES, STARTS, WRONG, YIELDS, Guess, SlipRows
from identification.free_friction.slips import Shown, Slips
from identification.measurement.pooled import speed_name

DIFFERENCE = 1e-6  # rad, rad/s
LEAST_BEFORE = 1e-3  # m/s, of slip before, below which it is the speed of a contact in stick

State = tuple[np.ndarray, np.ndarray]
Acceleration = Callable[[int | slice, State], np.ndarray]


def rows_of(slips: Slips, guess: Guess) -> list[SlipRows]:
    """Residuals of all slips and their derivatives."""
    if slips.rows and slips.rows[0][0] is guess:
        return slips.rows[0][1]
    angle, speed = slips.run(guess)
    with np.errstate(all="ignore"):
        responses = _responses(guess, slips, angle, speed)
    rows = []
    for number, segment in enumerate(slips.segments):
        reading = slips.shown(number, guess, angle, speed)
        columns = segment.whitened(_columns(slips, number, responses[:, number], reading))
        residual = segment.whitened((reading[0] - segment.measured)[:, None])[:, 0]
        rows.append(SlipRows(residual, columns[:, : STARTS + MODES], columns[:, STARTS + MODES :]))
    slips.rows[:] = [(guess, rows)]
    return rows


def _columns(slips: Slips, number: int, responses: np.ndarray, seen: Shown) -> np.ndarray:
    """Derivatives (n, m) of what the sensor shows from responses of the angle (m, count + 1), the last of which are
    of names that may move the sensor too."""
    at, share = slips.between(number)
    shown, slope, turning, misreadings = seen
    columns = ((1 - share) * responses[:, at] + share * responses[:, at + 1]).T * slope[:, None]
    first = columns.shape[1] - len(slips.names)
    sensors = {"gain": -shown, "gain" + WRONG: -shown, "laser": -shown, "delay": -slope * turning}
    if slips.ready.laser_alone and slips.segments[number].laser:
        sensors |= {"R": shown, "R" + WRONG: shown}
    lines = slips.segments[number].lines
    if lines is not None:
        sensors |= {"zero": np.ones(len(shown)), **{f"{LINE}{line}": lines == line for line in np.unique(lines)}}
    sensors |= {name: slope * misreading for name, misreading in misreadings.items()}
    for index, name in enumerate(slips.names, first):
        if name in sensors:
            columns[:, index] += sensors[name]
    return columns


def _responses(guess: Guess, slips: Slips, angle: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Responses of the angle at the steps (m, n_slips, count + 1): to start, unexplained torque, curve and names."""
    from scipy.integrate import cumulative_simpson

    steps, acceleration = slice(0, None, 2), slips.forces(guess)
    by_angle, by_speed = (
        (acceleration(steps, (angle + da * DIFFERENCE, speed + dv * DIFFERENCE))
         - acceleration(steps, (angle - da * DIFFERENCE, speed - dv * DIFFERENCE))) / (2 * DIFFERENCE)
        for da, dv in ((1, 0), (0, 1))
    )  # fmt: skip
    step = slips.lasts / slips.count
    fundamental = _fundamental(by_angle, by_speed, step)
    determinant = np.linalg.det(fundamental)

    def response(torque: np.ndarray) -> np.ndarray:
        """Of the angle to an acceleration (n_slips, count + 1)."""
        if not torque.any():
            return torque
        first, second = (
            step * cumulative_simpson(torque * part / determinant, axis=1, initial=0)
            for part in (-fundamental[..., 0, 1], fundamental[..., 0, 0])
        )
        return fundamental[..., 0, 0] * first + fundamental[..., 0, 1] * second

    return np.array(
        [
            fundamental[..., 0, 0],
            fundamental[..., 0, 1],
            *map(response, _forces(guess, slips, (angle, speed), acceleration)),
        ]
    )


def _forces(guess: Guess, slips: Slips, state: State, acceleration: Acceleration) -> list[np.ndarray]:
    """Derivatives of theta'' at the steps (n_slips, count + 1) by unexplained torque, curve and names."""
    rig, steps, (angle, speed) = slips.rig(guess), slice(0, None, 2), state
    scale = rig.R * rig.N / rig.J
    factor, by_friction = slips.factor(guess, state, steps, FRICTION)
    stiffer, by_spring = slips.factor(guess, state, steps, SPRING)
    damped, by_damping = slips.factor(guess, state, steps, DAMPING)
    faster, by_drive = slips.factor(guess, state, steps, DRIVE)
    driven = slips.driven(guess)[:, steps]
    drive = driven * faster
    slip = slips.sign * (rig.r * drive - rig.R * speed)
    rising = -slips.sign * rig.R * acceleration(steps, state) if slips.soft else np.zeros(angle.shape)
    seen = slips.before(guess, slip, rising) if guess.shared.get(YIELDS) else slip
    basis, steep = slips.curve.weights(seen), slips.curve.weights(slip, 1) @ guess.coefficients
    friction = slips.sign * (basis @ guess.coefficients)
    sooner = -rising * slips.soft * rig.N * (basis @ guess.coefficients) / np.maximum(seen, LEAST_BEFORE)
    torque = scale * (friction * factor + guess.unexplained @ slips.modes[:, steps])
    spring, damping = -rig.k / rig.J * angle, -rig.c / rig.J * speed
    slope = scale * factor * steep  # by the slip speed
    pulls = {FRICTION: scale * friction, SPRING: spring, DAMPING: damping, DRIVE: slope * rig.r * driven}
    logs = range(len(slips.ready.motions))
    slopes = {FRICTION: by_friction, SPRING: by_spring, DAMPING: by_damping, DRIVE: by_drive}
    forces: Mapping[str, np.ndarray] = {
        **{name: stiffer * spring for name in ("k", "k/J")},
        **{name: damped * damping for name in ("c", "c/J")},
        "N": torque,
        "R": torque - slope * rig.R * speed,
        "r": slope * rig.r * drive,
        AHEAD: scale * slips.sign * factor * steep * rising,
        YIELDS: scale * slips.sign * factor * (slips.curve.weights(seen, 1) @ guess.coefficients) * sooner,
        **{speed_name(log): slope * rig.r * drive * (slips.where.log[:, steps] == log) for log in logs},
        **{
            term.name: pulls[term.effect.acts] * slopes[term.effect.acts][number]
            for number, term in enumerate(slips.terms)
            if not term.of_sensor
        },
    }
    inertia = -torque
    for name, part in (("k", stiffer * spring), ("c", damped * damping)):
        inertia = inertia - part * (name in slips.names)
    forces = {**forces, "J": inertia}
    forces |= {name + WRONG: force for name, force in forces.items()}
    nothing = np.zeros(angle.shape)
    modes = [nothing + scale * mode for mode in slips.modes[:, steps]]
    shared = [scale * slips.sign * factor * part for part in np.moveaxis(basis, -1, 0)]
    return [*modes, *shared, *(nothing + forces.get(name, nothing) for name in slips.names)]


def _fundamental(by_angle: np.ndarray, by_speed: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Fundamental matrices (n_slips, count + 1, 2, 2) of  d'' = by_angle d + by_speed d'."""
    rate = np.zeros((*by_angle[:, 1:].shape, 2, 2))
    rate[..., 0, 1] = step
    rate[..., 1, 0] = 0.5 * step * (by_angle[:, 1:] + by_angle[:, :-1])
    rate[..., 1, 1] = 0.5 * step * (by_speed[:, 1:] + by_speed[:, :-1])
    square = rate @ rate
    over = np.eye(2) + rate + square / 2 + square @ rate / 6 + square @ square / 24
    fundamental = np.empty((*by_angle.shape, 2, 2))
    fundamental[:, 0] = np.eye(2)
    for number in range(over.shape[1]):
        fundamental[:, number + 1] = over[:, number] @ fundamental[:, number]
    return fundamental
