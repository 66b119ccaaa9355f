"""Instruments, one file each: from a true motion to raw readings, and from a log to angles and speeds."""

from rig_io.sensors.encoder import Edges as Edges
from rig_io.sensors.encoder import Encoder as Encoder
from rig_io.sensors.encoder import drive_speed as drive_speed
from rig_io.sensors.encoder import edges as edges
from rig_io.sensors.encoder import velocity_mid_interval as velocity_mid_interval
from rig_io.sensors.laser import Laser as Laser
from rig_io.sensors.laser import laser_angle as laser_angle
from rig_io.sensors.laser import laser_clipped as laser_clipped
from rig_io.sensors.laser import laser_displacement as laser_displacement
