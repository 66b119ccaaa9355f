"""Sizes that a rig can have: a column in another unit than stated shows by numbers that no disc, drive or clock has.

A unit of another dimension is found by its name; one of the same dimension only by the size of the numbers.
"""

from collections.abc import Mapping

import numpy as np

from fmu_models.base.errors import StickslipError
from rig_io.logs.columns import TIME
from rig_io.repair.counters import FASTEST

TURN = np.pi  # rad; the spring of the disc is wound no further
SLOWEST_CLOCK = 0.5  # s between samples: the disc swings in less than a second
FASTEST_CLOCK = 2e-6  # s; half a megahertz
LARGEST_RADIUS = 5.0  # m
COLDEST, HOTTEST = 120.0, 2000.0  # K, of a rig


def check_sizes(source: str, columns: Mapping[str, np.ndarray]) -> None:
    """Columns of a log, (n,) each in the unit of `rig_io.logs.columns`; NaN are passed over. StickslipError: numbers of
    a size that no rig has; says which unit would explain them."""
    step = float(np.median(np.diff(columns[TIME.name])))
    if step > SLOWEST_CLOCK:
        raise StickslipError(
            f"{source}: 'time' steps by {step:g} s, too slow to show the disc's swing. Milliseconds or a number of the "
            "sample in a column of seconds? State the unit in which it is written ('ms')."
        )
    if step < FASTEST_CLOCK:
        raise StickslipError(
            f"{source}: 'time' steps by {step:g} s, faster than any recorder of a rig. State the unit in which it is "
            "written."
        )
    for name, values in columns.items():
        if name == "angle":
            reach = float(np.nanmax(np.abs(values - np.nanmedian(values))))
            if reach > TURN:
                raise StickslipError(
                    f"{source}: 'angle' goes {reach:.3g} rad to one side, more than half a turn, which the spring does "
                    "not allow. Degrees (or counts) in a column of radians? State the unit in which it is written "
                    "('deg')."
                )
        elif name.endswith("_speed"):
            fastest = float(np.nanmax(np.abs(values)))
            if fastest > FASTEST:
                raise StickslipError(
                    f"{source}: '{name}' reaches {fastest:.4g} rad/s; drives of the rig stay below {FASTEST:g}. "
                    "Revolutions per minute or degrees per second in a column of rad/s? State the unit in which it is "
                    "written ('rpm', 'deg/s')."
                )
        elif name == "temperature" and not COLDEST < float(np.nanmedian(values)) < HOTTEST:
            raise StickslipError(
                f"{source}: 'temperature' is about {float(np.nanmedian(values)):.4g} K, which no rig is. Degrees "
                "Celsius in a column of kelvin? State the unit in which it is written ('degC')."
            )


def check_radius(where: str, name: str, radius: float) -> None:
    """Raises StickslipError: R or r (m) of a size that no disc of a bench has."""
    if radius > LARGEST_RADIUS:
        raise StickslipError(
            f"{where} is {radius:g} m, larger than any disc of a bench. Millimetres stated as metres? Write the unit "
            f'in which it was measured: "unit": "mm". ({name} is a radius, not a diameter.)'
        )
