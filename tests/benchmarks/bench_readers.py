"""Large logs: time and memory of our readers against the library of each format, both from a fresh process.

python tests/benchmarks/bench_readers.py [--rows 6000000] [--formats csv,h5,parquet,tdms,mf4,mat]

Columns: CPU time of the library and of ours (child process included), their ratio; peak memory of ours, the larger of
parent and child, over that of the data (rows x 5 x 8 bytes).
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

COLUMNS = 5


def log_of(rows: int) -> dict[str, np.ndarray]:
    """10 kHz of a swing, a drive and noise."""
    time = np.arange(rows) / 1e4
    noise = np.random.default_rng(0).standard_normal(rows)
    return {
        "time": time,
        "laser": np.round(5 + np.sin(6 * time) + 1e-3 * noise, 4),
        "noise": np.round(noise, 5),
        "encoder": np.floor(15 * np.sin(6 * time)),
        "drive": np.floor(150 * time),
    }


def write_csv(path: Path, log: Mapping[str, np.ndarray]) -> None:
    import pandas

    pandas.DataFrame(dict(log)).to_csv(path, index=False, float_format="%.6g")


def write_h5(path: Path, log: Mapping[str, np.ndarray]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        for name, values in log.items():
            file[name] = values


def write_parquet(path: Path, log: Mapping[str, np.ndarray]) -> None:
    import pyarrow
    from pyarrow import parquet

    parquet.write_table(pyarrow.table(dict(log)), path)


def write_tdms(path: Path, log: Mapping[str, np.ndarray]) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("Run", name, values) for name, values in log.items()])


def write_mf4(path: Path, log: Mapping[str, np.ndarray]) -> None:
    from asammdf import MDF, Signal

    with MDF() as file:
        file.append([Signal(v, log["time"], name=name) for name, v in log.items() if name != "time"])
        file.save(path, overwrite=True)


def write_mat(path: Path, log: Mapping[str, np.ndarray]) -> None:
    from scipy.io import savemat

    savemat(path, dict(log))


def read_csv(path: Path) -> Any:
    import pandas

    return pandas.read_csv(path)


def read_h5(path: Path) -> Any:
    import h5py

    with h5py.File(path) as file:
        return {name: file[name][()] for name in file}  # pyright: ignore[reportIndexIssue]


def read_parquet(path: Path) -> Any:
    from pyarrow import parquet

    table = parquet.read_table(path)
    return {name: column.to_numpy() for name, column in zip(table.column_names, table.columns, strict=True)}


def read_tdms(path: Path) -> Any:
    from nptdms import TdmsFile

    return {channel.name: channel[:] for channel in TdmsFile.read(path)["Run"].channels()}


def read_mf4(path: Path) -> Any:
    from asammdf import MDF

    with MDF(path) as file:
        return file.to_dataframe()


def read_mat(path: Path) -> Any:
    from scipy.io import loadmat

    return loadmat(path)


def read_ours(path: Path) -> Any:
    from rig_io import read_table

    return read_table(path)


Write = Callable[[Path, Mapping[str, np.ndarray]], None]
FORMATS: Mapping[str, tuple[Write, str]] = {
    "csv": (write_csv, "read_csv"),
    "h5": (write_h5, "read_h5"),
    "parquet": (write_parquet, "read_parquet"),
    "tdms": (write_tdms, "read_tdms"),
    "mf4": (write_mf4, "read_mf4"),
    "mat": (write_mat, "read_mat"),
}


def measured(reader: str, path: Path) -> tuple[float, float]:
    """CPU time in s and peak memory in bytes of one reading in a fresh process."""
    command = [sys.executable, __file__, "--read", reader, "--path", str(path)]
    seconds, peak = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    return float(seconds), float(peak)


def read_here(reader: str, path: Path) -> None:
    kept = globals()[reader](path)
    own, child = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = time.process_time() + child.ru_utime + child.ru_stime
    print(seconds, 1024 * max(own.ru_maxrss, child.ru_maxrss))
    del kept


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--rows", type=int, default=6_000_000)
    arguments.add_argument("--formats", default=",".join(FORMATS))
    arguments.add_argument("--read", help=argparse.SUPPRESS)
    arguments.add_argument("--path", type=Path, help=argparse.SUPPRESS)
    asked = arguments.parse_args()
    if asked.read:
        read_here(asked.read, asked.path)
        return
    log, data = log_of(asked.rows), 8.0 * COLUMNS * asked.rows
    print(f"{'format':8} {'library, s':>10} {'ours, s':>8} {'ratio':>6} {'memory/data':>12}")
    for name in asked.formats.split(","):
        write, library = FORMATS[name]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"log.{name}"
            write(path, log)
            theirs, _ = measured(library, path)
            ours, peak = measured("read_ours", path)
        print(f"{name:8} {theirs:10.2f} {ours:8.2f} {ours / theirs:6.2f} {peak / data:12.2f}", flush=True)


if __name__ == "__main__":
    main()
