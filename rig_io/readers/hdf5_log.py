"""HDF5: the vectors of one group (or of a table in it) as columns, with their attribute ``unit`` or ``units``."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from fmu_models.base.errors import StickslipError, nearest
from rig_io.logs.guarded import Channel, Channels, fits, of_one_length, table_of
from rig_io.logs.table import Reader, Table

if TYPE_CHECKING:
    import h5py


def read(path: Path, **options: str) -> Table:
    """Read every vector of a group as a column. StickslipError: the file is missing, damaged or none of its kind;
    several groups hold vectors and none is chosen."""
    return table_of(path, channels, "an HDF5 file with vectors of numbers", (b"\x89HDF\r\n\x1a\n",), **options)


def channels(path: str, group: str = "") -> Channels:
    """The vectors of a file; in the child."""
    import h5py

    with h5py.File(path, "r") as file:
        groups: dict[str, dict[str, Any]] = {}

        def visit(name: str, item: object) -> None:
            if isinstance(item, h5py.Dataset):
                inside, _, leaf = name.rpartition("/")
                groups.setdefault(inside, {})[leaf] = item

        file.visititems(visit)
        useful = {
            name: items
            for name, items in groups.items()
            if any(len(item.shape) == 1 and item.shape[0] > 1 for item in items.values())
        }
        if group and group.strip("/") not in useful:
            raise StickslipError(f"'{path}' has no group '{group}' with vectors.{nearest(group, useful)}")
        if not group and len(useful) > 1:
            listing = ", ".join(f"/{name}" for name in useful)
            raise StickslipError(
                f"'{path}' has vectors in the groups {listing}. Say which one: stickslip describe FILE --read "
                "group=NAME."
            )
        if not useful:
            return Channels([], {name: "no vector" for items in groups.values() for name in items})
        return _vectors(useful[group.strip("/") or next(iter(useful))])


def _vectors(items: dict[str, Any]) -> Channels:
    vectors: list[Channel] = []
    left_out: dict[str, str] = {}
    scalars: dict[str, float] = {}
    for name, item in items.items():
        if item.dtype.names and len(item.shape) == 1:
            rows = item[()]
            vectors += [Channel(n, rows[n]) for n in item.dtype.names if fits(n, rows[n], left_out)]
        elif item.shape in ((), (1,)) and item.dtype.kind in "biuf":
            scalars[name] = float(item[()] if item.shape == () else item[0])
        elif fits(name, item, left_out):
            vectors.append(Channel(name, item[()], _unit(item)))
    return Channels(of_one_length(vectors, left_out), left_out, scalars)


def _unit(item: "h5py.Dataset") -> str:
    for key in ("unit", "units", "Unit", "Units"):
        if key in item.attrs:
            unit = item.attrs[key]
            return unit.decode("utf-8", "replace") if isinstance(unit, bytes) else str(unit)
    return ""


READER = Reader((".h5", ".hdf5", ".hdf", ".he5"), read, {"group": "with the vectors, such as run/1"})
