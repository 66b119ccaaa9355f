"""Logs of a friction rig: read, checked, mended and written; and a bench that is emulated where there is none.

from rig_io import emulate_set, read_package, standard_set

emulate_set("my_rig", standard_set("paper/rubber"), seed=1)
logs = read_package("my_rig")
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fmu_models.base.exports import exports

if TYPE_CHECKING:
    __version__: str

    from rig_io.bench.drive import Ripple as Ripple
    from rig_io.bench.emulation import Disc as Disc
    from rig_io.bench.emulation import Emulation as Emulation
    from rig_io.bench.emulation import MicroSlip as MicroSlip
    from rig_io.bench.emulator import emulate as emulate
    from rig_io.bench.emulator import emulate_set as emulate_set
    from rig_io.bench.emulator import free_decay as free_decay
    from rig_io.bench.emulator import standard_set as standard_set
    from rig_io.bench.materials import Material as Material
    from rig_io.bench.materials import material as material
    from rig_io.bench.scenes import emulations as emulations
    from rig_io.logs.log import EncoderCalibration as EncoderCalibration
    from rig_io.logs.log import Experiment as Experiment
    from rig_io.logs.log import InstrumentCalibrations as InstrumentCalibrations
    from rig_io.logs.log import LaserCalibration as LaserCalibration
    from rig_io.logs.log import RigConstants as RigConstants
    from rig_io.logs.log import RigLog as RigLog
    from rig_io.logs.log import StatedQuantity as StatedQuantity
    from rig_io.logs.table import Reader as Reader
    from rig_io.logs.table import Table as Table
    from rig_io.packages.datapackage import read_log as read_log
    from rig_io.packages.datapackage import read_package as read_package
    from rig_io.packages.datapackage import write_package as write_package
    from rig_io.readers import read_table as read_table
    from rig_io.sensors.encoder import Encoder as Encoder
    from rig_io.sensors.laser import Laser as Laser
else:
    __getattr__, __dir__ = exports(__name__)
