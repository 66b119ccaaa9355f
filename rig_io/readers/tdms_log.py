"""TDMS (National Instruments): the channels of one group; a waveform's clock becomes the column ``time``."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fmu_models.base.errors import StickslipError, nearest
from rig_io.logs.guarded import Channel, Channels, fits, need, of_one_length, table_of
from rig_io.logs.stamps import NANO, seconds
from rig_io.logs.table import Reader, Table

TIME = "time"


def read(path: Path, **options: str) -> Table:
    """Read every channel of a group as a column. StickslipError: the file is missing, damaged or none of its kind;
    several groups and none chosen; npTDMS is not installed."""
    need("nptdms", "npTDMS", "TDMS files")
    return table_of(path, channels, "a TDMS file with channels of numbers", (b"TDSm",), **options)


def channels(path: str, group: str = "") -> Channels:
    """The channels of a file; in the child."""
    from nptdms import TdmsFile

    with TdmsFile.open(path) as file:
        groups = {group.name: group for group in file.groups() if len(group.channels())}
        if not group and len(groups) > 1:
            raise StickslipError(
                f"'{path}' holds the groups {', '.join(groups)}. Choose: stickslip describe FILE --read group=NAME."
            )
        if group and group not in groups:
            raise StickslipError(f"'{path}' holds no group '{group}'.{nearest(group, groups)}")
        if not groups:
            return Channels([])
        collected: list[Channel] = []
        left_out: dict[str, str] = {}
        origin, stamps, clock = "", [], None
        for channel in groups[group or next(iter(groups))].channels():
            values = channel[:]
            if values.dtype.kind == "M":
                values, first = seconds(values.astype("datetime64[ns]").astype(np.int64), "date and time", True)
                origin = first.isoformat() if first else ""
                stamps.append(channel.name)
                collected.append(Channel(channel.name, values, "s"))
            elif fits(channel.name, values, left_out):
                unit = channel.properties.get("unit_string") or channel.properties.get("NI_UnitDescription") or ""
                collected.append(Channel(channel.name, values, str(unit)))
                clock = clock or _clock(channel.properties, len(values))
        collected = of_one_length(collected, left_out)
        if clock and TIME not in {channel.name for channel in collected} and not stamps:
            origin, step, start = clock
            collected.insert(0, Channel(TIME, start + step * np.arange(len(collected[0].values)), "s"))
            stamps = [TIME] if origin else []
        notes = [f"{key}: {value}" for key, value in file.properties.items()]
    return Channels(collected, left_out, {}, origin, stamps, notes)


def _clock(properties: Mapping[str, Any], samples: int) -> tuple[str, float, float] | None:
    """Begin (ISO, "" if not stated), step in s and first time of a waveform."""
    step = properties.get("wf_increment")
    if not isinstance(step, int | float) or not step > 0 or not samples:
        return None
    start = float(properties.get("wf_start_offset", 0.0))
    at = properties.get("wf_start_time")
    if at is None:
        return "", float(step), start
    stamp = np.datetime64(at).astype("datetime64[ns]")
    midnight = stamp.astype("datetime64[D]")
    return f"{midnight}T00:00:00+00:00", float(step), start + float((stamp - midnight).astype(np.int64)) * NANO


READER = Reader((".tdms",), read, {"group": "of channels"})
