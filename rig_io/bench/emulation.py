"""What the bench does: constants, discs, drives, sensors, disturbances of one recording."""

from dataclasses import dataclass, field

from fmu_models.base.errors import StickslipError, refuse_unknown
from fmu_models.base.shown import Shown
from fmu_models.scene.scene import Scene
from rig_io.bench.disturbances import Disturbances
from rig_io.bench.drive import Ripple, held_duration
from rig_io.bench.materials import CONTI, MATERIALS, Material
from rig_io.logs.arrangement import MODELS, Arrangement
from rig_io.logs.log import RigConstants, StatedQuantity
from rig_io.repair.table import SHORTEST
from rig_io.sensors.encoder import Encoder
from rig_io.sensors.laser import Laser
from rig_io.sensors.load_cell import LoadCell
from rig_io.sensors.speed_sensor import SpeedSensor

TRUTH_RATE = 5000.0  # Hz, at which the motion is sampled before the instruments see it
LONGEST = 1000.0  # s of transient and log; 5 million samples of the truth
LOAD_STEP = 5e-3  # s between knots of a disturbed normal force: its second harmonic bends by 1e-5 of itself between
FASTEST = 100.0  # rad/s, of a drive; those of the rig reach 2.7
# the paper's appendix; uncertainties and normal forces (0.5 kg of dead weight) are assumed
RIG = RigConstants(
    J=StatedQuantity(0.0548, "kg*m^2", 0.0003),
    k=StatedQuantity(2.62, "N*m/rad", 0.015),
    c=StatedQuantity(0.055, "N*m*s/rad", 0.001),
    R=StatedQuantity(0.125, "m", 0.00005),
    r=StatedQuantity(0.06, "m", 0.00005),
    N0=StatedQuantity(4.905, "N", 0.005),
    N1=StatedQuantity(4.905, "N", 0.005),
)


@dataclass(frozen=True)
class Disc:
    """A driving disc in contact: its friction pair and its nominal speed, rad/s."""

    material: Material = MATERIALS["paper/rubber"]
    drive_speed: float = 0.83


@dataclass(frozen=True)
class MicroSlip:
    """Elastic contact below gross slip (LuGre); stiffness N/m (2e4 to 5e4 with rubber, 5e5 without), damping N s/m."""

    stiffness: float = 5e4
    damping: float = 100.0


@dataclass(frozen=True)
class Emulation(Shown):
    """One log to be emulated. Times in s, rates in Hz, angles in rad.

    discs: none for a free decay from ``start_angle``, one, or two. laser, encoder, drive_encoder, ripple and micro_slip
    may be None: not fitted, or ideal. speed_deviation: of the drives from their nominal speeds, relative, drawn for
    each log. arrangement: of two discs; changeover: the angle from which on disc 1 is touched
    instead of disc 0 (sequential), or up to which on either side both are (overlapping). scene: has the oscillator and
    its start in place of a rig at rest. disturbances: of a bench as it is, with disc 0 alone or none. load_cell:
    of each driving disc. speed_sensor: a tachometer or vibrometer of the disc. at_rest: the disc is let go at
    ``start_angle``, not carried along by disc 0. holds: s each, for which the drives stop one after the other
    (drive.py).
    """

    name: str
    discs: tuple[Disc, ...] = (Disc(),)
    rig: RigConstants = RIG
    arrangement: Arrangement = "together"
    changeover: float = 0.0
    duration: float = 20.0
    transient: float = 5.0
    sampling_rate: float = 1000.0
    start_angle: float = 0.0
    at_rest: bool = False
    laser: Laser | None = field(default_factory=Laser)
    encoder: Encoder | None = field(default_factory=Encoder)
    drive_encoder: Encoder | None = field(default_factory=Encoder)
    ripple: Ripple | None = field(default_factory=Ripple)
    speed_deviation: float = 0.0
    load_cell: LoadCell | None = None
    speed_sensor: SpeedSensor | None = None
    micro_slip: MicroSlip | None = None
    scene: Scene | None = None
    disturbances: Disturbances | None = None
    holds: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Raises StickslipError: more than two discs, no angle sensor, a time, rate or speed out of range."""
        if len(self.discs) > 2:
            raise StickslipError(f"'{self.name}': the rig has places for two driving discs, not {len(self.discs)}.")
        refuse_unknown(self.arrangement, MODELS, f"'{self.name}': there is no arrangement '{self.arrangement}'.")
        if self.arrangement != "together" and len(self.discs) != 2:
            raise StickslipError(
                f"'{self.name}': discs arranged '{self.arrangement}' are two, not {len(self.discs)}. Give both."
            )
        if self.disturbances is not None and (len(self.discs) > 1 or self.scene is not None):
            raise StickslipError(f"'{self.name}': disturbances are emulated of the rig with one disc, without a scene.")
        if any(not hold > 0 for hold in self.holds) or (self.holds and not self.discs):
            raise StickslipError(f"'{self.name}': holds are of a disc's drive and last longer than 0 s.")
        if self.holds and self.duration < held_duration(self.holds):
            raise StickslipError(
                f"'{self.name}': {self.duration:g} s have no room for {len(self.holds)} holds. Let the log last "
                f"{held_duration(self.holds):g} s."
            )
        if self.micro_slip is not None and any(disc.material.law != CONTI for disc in self.discs):
            raise StickslipError(f"'{self.name}': micro-slip is emulated before Conti's law. Leave out one of the two.")
        if self.laser is None and self.encoder is None:
            raise StickslipError(f"'{self.name}': no sensor sees the disc. Fit the laser or the encoder.")
        if not (self.duration > 0 and self.transient >= 0 and self.duration + self.transient <= LONGEST):
            raise StickslipError(
                f"'{self.name}': a duration of {self.duration:g} s after a transient of {self.transient:g} s cannot be "
                f"emulated. Choose a positive duration, a transient not negative, together up to {LONGEST:g} s."
            )
        if not (self.sampling_rate * self.duration >= SHORTEST and self.sampling_rate <= 2.0 * TRUTH_RATE):
            raise StickslipError(
                f"'{self.name}': {self.sampling_rate:g} Hz over {self.duration:g} s is no log. Take at least "
                f"{SHORTEST} samples, at up to {2.0 * TRUTH_RATE:g} Hz."
            )
        for disc in self.discs:
            if not abs(disc.drive_speed) <= FASTEST:
                raise StickslipError(
                    f"'{self.name}': a drive speed of {disc.drive_speed:g} rad/s is out of range. The rig's drives "
                    f"reach 2.7 rad/s; up to {FASTEST:g} is emulated."
                )

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the discs in contact."""
        return tuple(f"disc{i}" for i in range(len(self.discs)))
