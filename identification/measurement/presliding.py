"""Micro-slip in stick: how far the contact gives way under the force that it carries, before it slides.

A rigid contact in stick keeps  x = r integral(w) - R theta  constant. Bristles (LuGre) let it grow with its force F:
    dx = dF/(sigma0 (1 - F/F_s)),  that is   x = offset + C L(F),   L = -F_s ln(1 - F/F_s),   F = (c theta' + k theta)/R
with F_s = N mu_s the breakaway force and 1/C = sigma0 the pre-sliding stiffness (one offset for each stick; C by least
squares over all sticks, its deviation by jackknife over them). An error of the scale of the angle, or of r against R,
leaves a share of R theta in x: the slope of R theta by L times what is not known of these scales joins the deviation.
Sticks are taken without their begin, where the contact still rings, and up to 0.93 F_s, so that no slip enters.

Source: disc_rig paper, section 3.3 (the small protuberance before sticking); Canudas de Wit, Olsson, Astrom,
Lischinsky, IEEE Trans. Autom. Control 40 (1995), equations (2), (3) for a slip of one sign, inertia left out.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fmu_models.base.digits import value_with_sd
from identification.inference.uncertainty import clustered_covariance
from identification.measurement.disc_motion import nominal_drives
from identification.measurement.motion import SMOOTHING, DiscMotion, drive_angle
from identification.measurement.pooled import Pool
from rig_io.logs.log import stretches

BREAKAWAY = 0.93  # of the breakaway force, up to which a stick is used
CREEP = 0.25  # of the speed of the drive: slip above it is no stick, however slow the drive
TRIM = 1.0  # smoothing windows at the begin of a stick
LEAST = 2.0  # smoothing windows that must be left of it
FEWEST = 5  # sticks, below which their spread is not known
SOFT = 1e-5  # m/N, of a contact that gives way in stick by more than sensors leave open
SIGNIFICANT = 3.0  # standard deviations: one of a thousand rigid contacts
MODEL = 0.25  # relative: bristles of 5e4 N/m ring for longer than what is left out, and seem softer by 20 to 45 %
UNKNOWN_GAIN = 2e-3  # relative, of a laser that no encoder has checked


@dataclass(frozen=True)
class PreSliding:
    """compliance: m/N, and its standard deviations: noise, from the scatter of sticks; scale, from r, R and the gain of
    the angle (all constants, where the LuGre model was followed); model, of what is left out of it (inertia, ringing);
    sticks: number used; at_least: whether nobody says how well r or R are known."""

    compliance: float
    noise_deviation: float
    scale_deviation: float
    sticks: int
    model_deviation: float = 0.0
    at_least: bool = False

    @property
    def deviation(self) -> float:
        """Standard deviation of the compliance, m/N."""
        return float(np.hypot(np.hypot(self.noise_deviation, self.scale_deviation), self.model_deviation))

    @property
    def elastic(self) -> bool:
        """Whether the contact is surely not rigid."""
        return self.compliance > SIGNIFICANT * float(np.hypot(self.noise_deviation, self.scale_deviation))

    @property
    def stiffness(self) -> float | None:
        """Pre-sliding stiffness, N/m; None where the contact may be rigid."""
        return 1 / self.compliance if self.elastic else None

    @property
    def stiffness_deviation(self) -> float | None:
        """Standard deviation of the stiffness to first order, N/m."""
        return self.deviation / self.compliance**2 if self.elastic else None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings for a fit that takes the contact as rigid."""
        if not self.elastic:
            return ()
        stiffness = value_with_sd(self.stiffness or 0.0, self.stiffness_deviation, "N/m")
        stiffness = stiffness.replace("± ", "± at least ") if self.at_least else stiffness
        return (
            f"In stick the contact gives way: pre-sliding stiffness {stiffness}. The fit takes it as rigid: "
            "coefficients from slip change little, but the cycle of the rigid model is wrong (amplitude, period). Fit "
            "the LuGre law (--estimator lugre).",
        )


def presliding(ready: Pool, coefficient: float) -> PreSliding | None:
    """Compliance of the contact in stick over all logs; None where too few sticks are long enough.

    coefficient: of friction, at breakaway (mu_s).
    """
    unseen = any(nominal_drives(motion.log) for motion in ready.motions)
    if ready.drawn or unseen:  # edges of an encoder lie further apart than bristles give way, and drives turn unevenly
        return None
    rows = [stick for motion in ready.motions for stick in _sticks(ready, motion, coefficient * ready.values.N)]
    if len(rows) < FEWEST:
        return None
    cluster = np.repeat(np.arange(len(rows)), [len(row[0]) for row in rows])
    load, shift, border = (np.concatenate([row[i] for row in rows]) for i in range(3))
    power = float(load @ load)
    if not power > 0:
        return None
    compliance = float(load @ shift) / power
    noise = float(np.sqrt(clustered_covariance(load[:, None], compliance * load - shift, cluster)[0, 0]))
    scale = abs(float(load @ border)) / power * _scale_deviation(ready)
    at_least = any(prior.name in ("r", "R") and not prior.stated for prior in ready.priors)
    return PreSliding(compliance, noise, scale, len(rows), MODEL * abs(compliance), at_least)


def _scale_deviation(ready: Pool) -> float:
    """Relative standard deviation of r integral(w) against R theta."""
    relative = {prior.name: prior.standard_uncertainty / prior.value for prior in ready.priors}
    checked = ready.sensors.lines > 0
    gain = np.sqrt(ready.sensors.covariance[0, 0]) if checked else UNKNOWN_GAIN
    return float(np.sqrt(relative.get("r", 0.0) ** 2 + relative.get("R", 0.0) ** 2 + gain**2))


def _sticks(ready: Pool, motion: DiscMotion, breakaway: float) -> Iterator[tuple[np.ndarray, ...]]:
    """L(F) (n,) N, relative place (n,) m and R theta (n,) m in each stick, without their means. breakaway: N."""
    values = ready.values
    window = SMOOTHING * ready.natural_period
    creep = np.minimum(ready.threshold, CREEP * values.r * np.abs(motion.drive))
    sticking = np.abs(motion.slip(values.r, values.R, window)[0]) < creep
    trim = round(TRIM * window / motion.step)
    drive = drive_angle(motion, int(ready.contacts[0][-1]))
    shift = values.r * drive - values.R * motion.angle
    force = (values.c * values.r * motion.drive / values.R + values.k * motion.smoothed(window)) / values.R
    sticks = [(int(start), int(end)) for start, end in stretches(sticking) if start > 0 and end < len(sticking)]
    if not sticks:
        return
    over = np.ones(len(force)) if motion.loads is None else motion.loads[0] / values.N
    # a law of the wrong form may be far off at rest: no stick carries more than the sticks are seen to carry
    carried = np.abs(force) / over
    holds = over * min(breakaway, float(np.median([np.max(carried[start:end]) for start, end in sticks])))
    for start, end in sticks:
        first = start + trim
        beyond = np.abs(force[first:end]) > BREAKAWAY * holds[first:end]
        inside = slice(first, first + int(np.argmax(beyond)) if beyond.any() else end)
        if inside.stop - inside.start < LEAST * window / motion.step or motion.filled[inside].any():
            continue
        held = holds[inside]
        load = -held * np.sign(force[inside]) * np.log1p(-np.abs(force[inside]) / held)
        border = values.R * motion.angle[inside]
        yield load - load.mean(), shift[inside] - shift[inside].mean(), border - border.mean()
