"""One rig log, written in every format by a writer that is not ours; for the tests of all readers."""

from __future__ import annotations

import csv
import gzip
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

ROWS = 400
UNITS = {"time": "s", "laser": "V", "encoder_count": "1", "drive0_speed": "rpm"}


def rig_log(rows: int = ROWS) -> dict[str, np.ndarray]:
    """A disc that swings, and a drive."""
    time = 0.001 * np.arange(rows)
    noise = np.random.default_rng(3).normal(0, 1e-3, rows)
    swing = 0.2 * np.sin(12 * time)
    return {
        "time": time,
        "laser": 5 + 12.5 * np.sin(swing) + noise,
        "encoder_count": np.floor(swing / (2 * np.pi / 1000)),
        "drive0_speed": 8 + 0.01 * noise,
    }


def text(path: Path, log: Mapping[str, np.ndarray]) -> None:
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([f"{name} [{UNITS[name]}]" for name in log])
        writer.writerows([repr(float(v)) for v in row] for row in zip(*log.values(), strict=True))


def blanks(path: Path, log: Mapping[str, np.ndarray]) -> None:
    np.savetxt(path, np.column_stack(list(log.values())), fmt="%.17g")


def lvm(path: Path, log: Mapping[str, np.ndarray]) -> None:
    names = [name for name in log if name != "time"]
    cells = "\t".join(UNITS[name] for name in names)
    head = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n"
        "Multi_Headings\tNo\nX_Columns\tOne\nTime_Pref\tRelative\n***End_of_Header***\t\n\t\n"
        f"Channels\t{len(names)}\nSamples\t{len(log['time'])}\nY_Unit_Label\t{cells}\nX0\t0\nDelta_X\t0.001\n"
        f"***End_of_Header***\t\nX_Value\t" + "\t".join(names) + "\tComment\n"
    )
    rows = ["\t".join(repr(float(v)) for v in row) for row in zip(*log.values(), strict=True)]
    path.write_bytes((head + "\n".join(rows) + "\n").replace("\n", "\r\n").encode("latin-1"))


def tdms(path: Path, log: Mapping[str, np.ndarray]) -> None:
    from nptdms import ChannelObject, RootObject, TdmsWriter

    with TdmsWriter(path) as writer:
        half = len(log["time"]) // 2
        for part in (slice(0, half), slice(half, None)):  # as a recorder flushes
            channels = [ChannelObject("Run", name, v[part], {"unit_string": UNITS[name]}) for name, v in log.items()]
            writer.write_segment([RootObject({"title": "bench"}), *channels])


def mdf(path: Path, log: Mapping[str, np.ndarray]) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        signals = [Signal(v, log["time"], unit=UNITS[name], name=name) for name, v in log.items() if name != "time"]
        file.append(signals)
        file.save(path, overwrite=True, compression=2)


def hdf5(path: Path, log: Mapping[str, np.ndarray]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        for name, values in log.items():
            made = file.create_dataset(f"run/{name}", data=values, compression="gzip")
            made.attrs["unit"] = UNITS[name]


def matlab(path: Path, log: Mapping[str, np.ndarray]) -> None:
    from scipy.io import savemat

    savemat(path, dict(log), do_compression=True, oned_as="column")


def parquet(path: Path, log: Mapping[str, np.ndarray]) -> None:
    import pyarrow
    from pyarrow import parquet as files

    fields = [pyarrow.field(name, pyarrow.float64(), metadata={"unit": UNITS[name]}) for name in log]
    files.write_table(pyarrow.table(list(map(pyarrow.array, log.values())), schema=pyarrow.schema(fields)), path)


def xlsx(path: Path, log: Mapping[str, np.ndarray]) -> None:
    from openpyxl import Workbook

    book = Workbook()
    book.create_sheet("Remarks")
    sheet = book.create_sheet("Run 1")
    sheet.append([f"{name} [{UNITS[name]}]" for name in log])
    for row in zip(*log.values(), strict=True):
        sheet.append([float(v) for v in row])
    book.save(path)


def ods(path: Path, log: Mapping[str, np.ndarray]) -> None:
    import pandas

    frame = pandas.DataFrame({f"{name} [{UNITS[name]}]": v for name, v in log.items()})
    engine: Any = "odf"
    frame.to_excel(path, sheet_name="Run 1", index=False, engine=engine)


def packed(write: Callable[[Path, Mapping[str, np.ndarray]], None]) -> Callable[[Path, Mapping[str, np.ndarray]], None]:
    """The same in an archive."""

    def pack(path: Path, log: Mapping[str, np.ndarray]) -> None:
        inner = path.with_suffix("")
        write(inner, log)
        if path.suffix == ".gz":
            path.write_bytes(gzip.compress(inner.read_bytes()))
        else:
            with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
                archive.write(inner, inner.name)
        inner.unlink()

    return pack


# suffix -> who writes it; and whether the format keeps units
FORMATS: Mapping[str, tuple[Callable[[Path, Mapping[str, np.ndarray]], None], bool]] = {
    ".csv": (text, True),
    ".lvm": (lvm, True),
    ".tdms": (tdms, True),
    ".mf4": (mdf, True),
    ".h5": (hdf5, True),
    ".mat": (matlab, False),
    ".parquet": (parquet, True),
    ".xlsx": (xlsx, True),
    ".ods": (ods, True),
    ".dat": (blanks, False),
    ".csv.gz": (packed(text), True),
    ".csv.zip": (packed(text), True),
    ".h5.gz": (packed(hdf5), True),
}
