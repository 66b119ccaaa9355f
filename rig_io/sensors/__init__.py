"""Instruments, one file each: from a true motion to raw readings, and from a log to angles and speeds."""

from rig_io.sensors.angle import disc_angle
from rig_io.sensors.encoder import Edges, Encoder, edges, encoder_angle, encoder_edges
from rig_io.sensors.laser import Laser, laser_angle, laser_clipped, laser_displacement
from rig_io.sensors.velocity import drive_speed, velocity_by_count, velocity_mid_interval, velocity_real_time_period

__all__ = [
    "Edges",
    "Encoder",
    "Laser",
    "disc_angle",
    "drive_speed",
    "edges",
    "encoder_angle",
    "encoder_edges",
    "laser_angle",
    "laser_clipped",
    "laser_displacement",
    "velocity_by_count",
    "velocity_mid_interval",
    "velocity_real_time_period",
]
