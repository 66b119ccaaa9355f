"""All slips of one driving disc at once: their motion under a free friction.

    theta'' = -(k K/J) theta - (c C/J) omega + (R N/J) (s mu(v) A + x(t)),    v = s (r w W - R omega),
    x(t) = sum_n x_n cos(n pi t/T), n = 0 .. 3

s is the direction of slip, A, K, C, W the factors of disturbances, w the speed of the drive, T how long the slip lasts.
x is what no term explains, in units of the friction coefficient: being part of the torque, and not of the residual, it
holds the motion near the record however wrong the model is. Slips run side by side by the Runge-Kutta method of fourth
order.

A contact that gives way in stick by C may forget what it was over z = y C N mu(v) of slip, as bristles do: friction is

    mu(v - z v'/v) + sigma1 C mu'(v) v',    to first order in z,

with y near 1 and sigma1 C, a time. Source: Canudas de Wit, Olsson, Astrom, Lischinsky (1995), IEEE Trans.
Autom. Control 40, 419, equations (1) to (3), z and sigma1 small.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from identification.disturbances.term import (
    DAMPING,
    DRIVE,
    FRICTION,
    SPRING,
    DisturbanceTerm,
    Whereabouts,
    disturbed,
    misread,
)
from identification.estimators.regression import load_factor, warmth
from identification.estimators.segment_runs import ShootingSegment
from identification.estimators.shooting_segments import LINE
from identification.free_friction.guess import AHEAD, MODES, WRONG, YIELDS, Guess, SlipRows
from identification.free_friction.result import SpeedBasis
from identification.measurement.motion import drive_angle
from identification.measurement.pooled import Pool, RigValues, rig_values, speed_name
from rig_io.sensors.motion import Motion

STEPS = 80  # a natural period: an error of 1e-6 of the motion, and of 1e-3 of the noise

Shown = tuple[np.ndarray, np.ndarray, np.ndarray, dict[str, np.ndarray]]  # see `Slips.shown`


@dataclass(frozen=True, eq=False)
class Slips:
    """Slips of pooled logs. terms: disturbances beside the friction; names: of what is shared, after the curve; soft:
    m/N, by which the contact gives way in stick; rows: those of the last guess (`responses.rows_of`)."""

    ready: Pool
    segments: tuple[ShootingSegment, ...]
    curve: SpeedBasis
    terms: tuple[DisturbanceTerm, ...]
    names: tuple[str, ...]
    soft: float = 0.0
    _last: list[tuple[Guess, set[str], tuple[np.ndarray, np.ndarray]]] = field(default_factory=list, repr=False)
    rows: list[tuple[Guess, list[SlipRows]]] = field(default_factory=list, init=False, repr=False)

    def with_noise(self, louder: float) -> Slips:
        """The same slips seen by sensors whose noise is larger."""
        segments = tuple(replace(segment, deviation=louder * segment.deviation) for segment in self.segments)
        return self._alike(replace(self, segments=segments))

    def under(self, terms: Sequence[DisturbanceTerm], names: Sequence[str] = ()) -> Slips:
        """The same slips under other terms, of which these are shared."""
        return self._alike(replace(self, terms=tuple(terms), names=tuple(names)))

    def torn(self, tau: float) -> float:
        """Deviation of a torque that may be the same in every slip, in units of the friction coefficient. tau: of one
        that is another in each."""
        decay = self.ready.decay
        return tau if decay is None else max(tau, decay.pull * self.ready.values.spring)

    def _alike(self, other: Slips) -> Slips:
        other.__dict__.update(
            {name: getattr(self, name) for name in ("lasts", "count", "sign", "time", "drive", "where")}
        )
        return other

    @cached_property
    def lasts(self) -> np.ndarray:
        """(n_slips, 1) s."""
        return np.array([[segment.time[-1] - segment.start_time] for segment in self.segments])

    @cached_property
    def count(self) -> int:
        """Steps of each slip."""
        return int(np.ceil(STEPS * float(self.lasts.max()) / self.ready.natural_period))

    @cached_property
    def sign(self) -> np.ndarray:
        """Direction of slip (n_slips, 1)."""
        return np.array([[float(segment.sign)] for segment in self.segments])

    @cached_property
    def time(self) -> np.ndarray:
        """(n_slips, 2 count + 1) s, at the steps and halfway."""
        starts = np.array([[segment.start_time] for segment in self.segments])
        return starts + self.lasts * np.linspace(0, 1, 2 * self.count + 1)

    @cached_property
    def drive(self) -> np.ndarray:
        """Speed of the drive (n_slips, 2 count + 1), rad/s."""
        drives = [segment.drives[0] for segment in self.segments]
        return np.array([np.interp(t, drive.time, drive.value) for t, drive in zip(self.time, drives, strict=True)])

    @cached_property
    def modes(self) -> np.ndarray:
        """cos(n pi t/T) (MODES, 2 count + 1)."""
        return np.cos(np.pi * np.arange(MODES)[:, None] * np.linspace(0, 1, 2 * self.count + 1))

    @cached_property
    def where(self) -> Whereabouts:
        """Where and when forces act, but for angle and speed of the body (n_slips, 2 count + 1)."""
        motions = [self.ready.motions[segment.log] for segment in self.segments]
        turned, load, share, warmer = [], [], [], []
        angles = {key: drive_angle(m, int(m.log.contacts[0][-1])) for key, m in {id(m): m for m in motions}.items()}
        lasts = np.array([[motion.time[-1] - motion.time[0]] for motion in motions])
        for time, motion in zip(self.time, motions, strict=True):
            turned.append(np.interp(time, motion.time, angles[id(motion)]))
            load.append(np.interp(time, motion.time, load_factor(motion, self.ready.values.N)))
            warmer.append(np.interp(time, motion.time, warmth(motion)))
            share.append((time - motion.time[0]) / (motion.time[-1] - motion.time[0]) - 0.5)
        log, same = np.array([[segment.log] for segment in self.segments]), np.ones((1, self.time.shape[1]))
        nothing, load, lasts = np.zeros(self.time.shape), np.array(load), lasts * same
        side, warmer = self.sign * same, np.array(warmer)
        return Whereabouts(np.array(turned), nothing, np.array(share), log * same, load, lasts, nothing, side, warmer)

    def constants(self, guess: Guess) -> dict[str, float]:
        """Constants of the rig at a guess, by name."""
        stated = {prior.name: prior.value for prior in self.ready.priors}
        off = {name: guess.shared.get(name, 0.0) + guess.shared.get(name + WRONG, 0.0) for name in stated}
        return {name: value * float(np.exp(off[name])) for name, value in stated.items()}

    def rig(self, guess: Guess) -> RigValues:
        """Constants of the rig at a guess."""
        return rig_values(self.constants(guess))

    def driven(self, guess: Guess) -> np.ndarray:
        """Speed of the drive (n_slips, 2 count + 1), rad/s, where that of a log is known no better than it was set."""
        off = [guess.shared.get(speed_name(segment.log), 0.0) for segment in self.segments]
        return self.drive * np.exp(off)[:, None]

    def factor(
        self, guess: Guess, state: tuple[np.ndarray, np.ndarray], place: int | slice, acts: str
    ) -> tuple[np.ndarray, list[np.ndarray]]:
        """A, K, C or W of disturbances at angles and speeds of the body, and its derivative by each of `terms`."""
        values = np.array([guess.shared.get(term.name, 0.0) for term in self.terms])
        where = self.where.map(lambda part: part[:, place])
        return disturbed(self.terms, values, replace(where, angle=state[0], speed=state[1]), acts)

    def forces(self, guess: Guess) -> Callable[[int | slice, tuple[np.ndarray, np.ndarray]], np.ndarray]:
        """theta'' at a place in time, of angles and speeds, each (n_slips,) or (n_slips, n)."""
        rig, coefficients, unexplained = self.rig(guess), guess.coefficients, guess.unexplained
        drive = self.driven(guess)
        timed, bodily = ({acts: self.under(terms) for acts, terms in some.items()} for some in self._terms)
        still = {acts: slips.factor(guess, self._anywhere, slice(None), acts)[0] for acts, slips in timed.items()}

        def factor(acts: str, place: int | slice, state: tuple[np.ndarray, np.ndarray]) -> np.ndarray | float:
            held = still[acts][:, place] if acts in still else 1.0
            return held * bodily[acts].factor(guess, state, place, acts)[0] if acts in bodily else held

        def acceleration(place: int | slice, state: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
            angle, speed = state
            sign = self.sign[:, 0] if isinstance(place, int) else self.sign
            slip = sign * (rig.r * drive[:, place] * factor(DRIVE, place, state) - rig.R * speed)
            rubbing, beside = sign * factor(FRICTION, place, state), unexplained @ self.modes[:, place]
            spring, damping = rig.k * factor(SPRING, place, state), rig.c * factor(DAMPING, place, state)

            def pulled(friction: np.ndarray) -> np.ndarray:
                torque = rig.R * rig.N * (rubbing * friction + beside)
                return (torque - spring * angle - damping * speed) / rig.J

            rigid = pulled(self.curve.value(coefficients, slip))
            if not guess.shared.get(YIELDS):
                return rigid
            faster = -sign * rig.R * rigid
            before, slope = self.before(guess, slip, faster), self.curve.weights(slip, 1) @ coefficients
            return pulled(self.curve.value(coefficients, before) + guess.shared.get(AHEAD, 0.0) * slope * faster)

        return acceleration

    def before(self, guess: Guess, slip: np.ndarray, faster: np.ndarray) -> np.ndarray:
        """Slip speeds that friction is of: those a way of slip ago. faster: m/s^2, their rise."""
        way = guess.shared.get(YIELDS, 0.0) * self.soft * self.rig(guess).N * self.curve.value(guess.coefficients, slip)
        return np.sqrt(np.maximum(slip**2 - 2 * faster * way, 0.0))

    @cached_property
    def _anywhere(self) -> tuple[np.ndarray, np.ndarray]:
        """No angle and no speed: what hangs on either becomes no number."""
        nothing = np.full(self.time.shape, np.nan)
        return nothing, nothing

    @cached_property
    def _terms(self) -> tuple[dict[str, list[DisturbanceTerm]], dict[str, list[DisturbanceTerm]]]:
        """By what they act on, the terms whose factor time alone moves, and those whose factor the body does."""
        where = self.where.map(lambda part: part[:1, :1])
        nowhere = replace(where, angle=np.full((1, 1), np.nan), speed=np.full((1, 1), np.nan))
        forces = [term for term in self.terms if not term.of_sensor]
        named = {term.name: (term.effect.acts, term.effect.factor or term.effect.name) for term in forces}
        bodily = {named[term.name] for term in forces if np.isnan(term.shape(nowhere)).any()}
        split: tuple[dict[str, list[DisturbanceTerm]], dict[str, list[DisturbanceTerm]]] = ({}, {})
        for term in forces:
            split[named[term.name] in bodily].setdefault(term.effect.acts, []).append(term)
        return split

    def run(self, guess: Guess) -> tuple[np.ndarray, np.ndarray]:
        """Angles and speeds (n_slips, count + 1), rad and rad/s."""
        acting = {term.name for term in self.terms if guess.shared.get(term.name)}
        for last, acted, motion in self._last:
            if last is guess and acted == acting:
                return motion
        motion = self._run(guess)
        self._last[:] = [(guess, acting, motion)]
        return motion

    def _run(self, guess: Guess) -> tuple[np.ndarray, np.ndarray]:
        acceleration, step = self.forces(guess), self.lasts[:, 0] / self.count
        motion = np.empty((2, len(self.segments), self.count + 1))
        angle, speed = motion[..., 0] = guess.starts.T
        for number in range(self.count):
            row = 2 * number
            first = acceleration(row, (angle, speed))
            speed2 = speed + 0.5 * step * first
            second = acceleration(row + 1, (angle + 0.5 * step * speed, speed2))
            speed3 = speed + 0.5 * step * second
            third = acceleration(row + 1, (angle + 0.5 * step * speed2, speed3))
            speed4 = speed + step * third
            fourth = acceleration(row + 2, (angle + step * speed3, speed4))
            angle = angle + step / 6 * (speed + 2 * speed2 + 2 * speed3 + speed4)
            speed = speed + step / 6 * (first + 2 * second + 2 * third + fourth)
            motion[..., number + 1] = angle, speed
        return motion[0], motion[1]

    def slip_speeds(self, guess: Guess) -> np.ndarray:
        """At the steps (n_slips, count + 1), m/s."""
        rig = self.rig(guess)
        return self.sign * (rig.r * self.driven(guess)[:, ::2] - rig.R * self.run(guess)[1])

    def squares(self, guess: Guess) -> float:
        """Sum of squares of the whitened residuals; infinite where no motion is."""
        with np.errstate(all="ignore"):
            angle, speed = self.run(guess)
            if not np.isfinite(angle).all():
                return float("inf")
            squares = 0.0
            for number, segment in enumerate(self.segments):
                off = self.shown(number, guess, angle, speed)[0] - segment.measured
                squares += float(np.sum(segment.whitened(off[:, None]) ** 2))
            return squares

    def shown(self, number: int, guess: Guess, angle: np.ndarray, speed: np.ndarray) -> Shown:
        """What the sensor of a slip would show (n,), its derivative by the angle, speeds (n,), and derivatives by the
        terms of sensors."""
        segment, shared = self.segments[number], guess.shared
        at, share = self.between(number)
        turned = Motion(self.time[number, ::2], angle[number], speed[number]).angle_at(segment.time)
        turning = (1 - share) * speed[number, at] + share * speed[number, at + 1]
        terms = [term for term in self.terms if term.of_sensor and term.log in (None, segment.log)]
        values = np.array([shared.get(term.name, 0.0) for term in terms])
        log = self.ready.motions[segment.log].time
        where = Whereabouts.seen(log, segment.log, segment.time, turned, turning)
        misreading, slopes = misread(terms, values, where)
        slopes = dict(zip([term.name for term in terms], slopes, strict=True))
        turned = turned + misreading - shared.get("delay", 0.0) * turning
        if segment.lines is not None:
            ruled, index = np.unique(segment.lines, return_inverse=True)
            ruling = np.array([shared.get(f"{LINE}{line}", 0.0) for line in ruled])
            turned = turned + shared.get("zero", 0.0) + ruling[index]
        if not segment.laser:
            return turned, np.ones(len(turned)), turning, slopes
        lever = self.ready.values.R
        relative = sum(shared.get(name, 0.0) for name in ("gain", "gain" + WRONG, "laser"))
        if self.ready.laser_alone:
            relative -= shared.get("R", 0.0) + shared.get("R" + WRONG, 0.0)
        return lever * np.sin(turned) * (1 - relative), lever * np.cos(turned), turning, slopes

    def between(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Of a slip's samples: the step before each (n,), and the share of the step that is gone."""
        step = float(self.lasts[number, 0]) / self.count
        position = (self.segments[number].time - self.segments[number].start_time) / step
        at = np.clip(position.astype(np.intp), 0, self.count - 1)
        return at, position - at
