"""The columns a rig log may hold: name, unit and meaning, once."""

from dataclasses import dataclass

from fmu_models.base.errors import StickslipError
from fmu_models.base.unit_names import conversion


@dataclass(frozen=True)
class LogColumn:
    """One column; ``whole``: its cells are whole numbers (counts)."""

    name: str
    unit: str
    description: str
    whole: bool = False


def _drive(disc: int) -> tuple[LogColumn, ...]:
    return (
        LogColumn(
            f"drive{disc}_count", "1", f"edges of the encoder on drive {disc}, signed sum up to the tick", whole=True
        ),
        LogColumn(f"drive{disc}_edge_time", "s", f"clock time of the last edge of drive {disc} at or before the tick"),
        LogColumn(f"drive{disc}_speed", "rad/s", f"angular speed of driving disc {disc}, already converted"),
    )


TIME = LogColumn("time", "s", "time of the tick")
COLUMNS: dict[str, LogColumn] = {
    column.name: column
    for column in (
        TIME,
        LogColumn("laser", "V", "laser telemeter on the disc's border, in V or as a length"),
        LogColumn("encoder_count", "1", "edges of the encoder on the disc, signed sum up to the tick", whole=True),
        LogColumn("encoder_edge_time", "s", "clock time of the encoder's last edge at or before the tick"),
        *_drive(0),
        *_drive(1),
        LogColumn("angle", "rad", "angle of the disc, already converted"),
        LogColumn("tachometer", "rad/s", "angular speed of the disc by a tachometer"),
        LogColumn("vibrometer", "m/s", "speed of the disc's border by a vibrometer, that of R sin(angle)"),
        LogColumn("load0", "N", "normal force of driving disc 0 by a load cell"),
        LogColumn("load1", "N", "normal force of driving disc 1 by a load cell"),
        LogColumn("temperature", "K", "temperature of the contact, or of what is near it"),
        LogColumn("trigger", "1", "a mark that two recorders share; it joins their clocks"),
    )
}
ANGLE_SOURCES = ("laser", "encoder_count", "angle")


def metres(unit: str | None) -> float | None:
    """Metres of one unit of length; None for another unit, or where none is stated."""
    try:
        return None if unit is None else conversion(unit, "m", "")
    except StickslipError:
        return None
