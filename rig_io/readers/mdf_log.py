"""MDF 3 and 4 (vehicles' recorders): the signals of one channel group, with its master channel as ``time``."""

from pathlib import Path

from fmu_models.base.errors import StickslipError
from rig_io.logs.guarded import Channel, Channels, fits, need, table_of
from rig_io.logs.table import Reader, Table

TIME = "time"


def read(path: Path, **options: str) -> Table:
    """Read every signal of a channel group as a column. StickslipError: the file is missing, damaged or none of its
    kind; several groups and none chosen; asammdf is not installed."""
    need("asammdf", "asammdf", "MDF files")
    return table_of(path, channels, "an MDF file with signals", (b"MDF ", b"UnFinMF "), **options)


def channels(path: str, group: str = "") -> Channels:
    """The signals of a file; in the child."""
    from asammdf import MDF

    with MDF(path) as file:
        filled = [i for i, group in enumerate(file.groups) if group.channel_group.cycles_nr and len(group.channels) > 1]
        if not filled:
            return Channels([])
        if not group and len(filled) > 1:
            listing = ", ".join(
                f"{i} ({group.channels[-1].name} ...)" for i in filled[:8] for group in [file.groups[i]]
            )
            raise StickslipError(
                f"'{path}' holds the channel groups {listing}. Choose: stickslip describe FILE --read group=NUMBER."
            )
        if group and (not group.isdigit() or int(group) not in filled):
            raise StickslipError(f"'{path}' holds no channel group '{group}'; there are {', '.join(map(str, filled))}.")
        chosen = int(group) if group else filled[0]
        collected: list[Channel] = []
        left_out: dict[str, str] = {}
        masters = file.masters_db
        for index, channel in enumerate(file.groups[chosen].channels):
            if masters.get(chosen) == index:
                continue
            signal = file.get(group=chosen, index=index)
            if not collected:
                collected.append(Channel(TIME, signal.timestamps, "s"))
            name = channel.name if channel.name != TIME else f"{TIME} (2)"
            if fits(name, signal.samples, left_out):
                collected.append(Channel(name, signal.samples, signal.unit or ""))
        start = file.header.start_time
        notes = [str(file.header.comment or "").strip()]
    stamped = start is not None and start.year > 1980
    return Channels(
        collected if len(collected) > 1 else [], left_out, {}, "", [], [n for n in notes if n and not stamped]
    )


READER = Reader((".mf4", ".mdf", ".mf3"), read, {"group": "number of the channel group"})
