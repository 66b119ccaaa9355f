"""The same emulated bench, written as six recorders leave it; by other writers than the suite's own.

python tests/end_to_end/recorders.py FOLDER     writes all of them, each into a folder, with the answers to `describe`
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from rig_io.bench.emulator import emulate, standard_set
from rig_io.logs.log import RigLog

TRUTH = {"mu_s": 0.65, "mu_k": 0.35, "p": 15.0}
OFFSET, DRIFT = 1.234567, 80e-6  # of the second recorder's clock against the first's: s, relative

CONSTANTS = """
J = "0.0548 ± 0.0003 kg m²"
R = "125 ± 0.05 mm"
r = "0,06 ± 0,00005 m"
N0 = "4.905 ± 0.005 N"
"""
VALUES = (
    f"[values]{CONSTANTS}"
    + """laser = "0.01 ± 0.00002 m/V, 5 V"
encoder = "1000"
drive0 = "1000"
"""
)


def bench(duration: float = 12.0, seed: int = 11) -> list[RigLog]:
    """Three drive speeds and a free decay."""
    return [emulate(one, seed, i) for i, one in enumerate(standard_set(duration=duration))]


def _cell(value: float, digits: int) -> str:
    return f"{value:.{digits}f}".replace(".", ",")


def semicolons(folder: Path, logs: Sequence[RigLog]) -> str:
    """Lines above the header, German names, milliseconds, degrees per second, decimal comma, semicolons, Latin-1."""
    for log in logs:
        drive = "drive0_count" in log.columns
        names = ["Zeit [ms]", "Weg Laser [V]", "Drehgeber Scheibe (Impulse)"] + ["Impulse Antrieb"] * drive
        lines = [
            "Messrechner Prüfstand 3;;;",
            "Prüfer: Müller;;;",
            "Datum: 03.11.2025;;;",
            "Abtastrate: 1000 Hz;;;",
            ";;;",
            ";".join(names),
        ]
        for i, t in enumerate(log.time):
            row = [_cell(1e3 * t, 4), _cell(log.columns["laser"][i], 4), str(int(log.columns["encoder_count"][i]))]
            lines.append(";".join(row + ([str(int(log.columns["drive0_count"][i]))] if drive else [])))
        (folder / f"{log.name}.csv").write_bytes("\r\n".join([*lines, ""]).encode("latin-1"))
    return f"confirm = true\n{VALUES}"


LVM_HEAD = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t,
Multi_Headings\tNo
X_Columns\tOne
Time_Pref\tRelative
Operator\tlab
Date\t2025/11/03
Time\t14:02:31,5041
***End_of_Header***\t
\t
Channels\t{n}{tabs}
Samples\t{samples}
Date\t{dates}
Time\t{times}
Y_Unit_Label\t{units}
X_Dimension\t{dimensions}
X0\t{starts}
Delta_X\t{steps}
***End_of_Header***{tabs}
X_Value\t{names}\tComment
"""


def lvm(folder: Path, logs: Sequence[RigLog]) -> str:
    """LabVIEW's text files."""
    for log in logs:
        columns = {"Laser": log.columns["laser"], "Encoder_Disc": log.columns["encoder_count"]}
        if "drive0_count" in log.columns:
            columns["Encoder_Drive"] = log.columns["drive0_count"]
        n = len(columns)
        fill = {key: "\t".join([text] * n) for key, text in LVM_CELLS.items()}
        fill |= {"samples": "\t".join([str(len(log.time))] * n), "names": "\t".join(columns)}
        fill |= {"units": "\t".join(["V", *[""] * (n - 1)])}
        text = LVM_HEAD.format(n=n, tabs="\t" * n, **fill)
        rows = [
            "\t".join([_cell(t, 6), *(_cell(v[i], 6) for v in columns.values())]) + ("\tstart" if i == 0 else "")
            for i, t in enumerate(log.time)
        ]
        (folder / f"{log.name}.lvm").write_bytes(
            (text + "\n".join(rows) + "\n").replace("\n", "\r\n").encode("latin-1")
        )
    return f"confirm = true\n{VALUES}"


LVM_CELLS = {
    "dates": "2025/11/03",
    "times": "14:02:31,5041",
    "dimensions": "Time",
    "starts": "0,0000000000000000E+0",
    "steps": "0,001000",
}


def tdms(folder: Path, logs: Sequence[RigLog]) -> str:
    """National Instruments' binary files: waveforms without a column of time."""
    from nptdms import ChannelObject, RootObject, TdmsWriter

    for log in logs:
        step = {"wf_increment": 0.001, "wf_start_offset": 0.0, "wf_samples": len(log.time)}
        names = {"laser": ("Laser", "V"), "encoder_count": ("Encoder disc", ""), "drive0_count": ("Encoder drive", "")}
        with TdmsWriter(folder / f"{log.name}.tdms") as writer:
            objects: list[object] = [RootObject({"operator": "lab"})]
            for column, (name, unit) in names.items():
                if column in log.columns:
                    values = log.columns[column]
                    data = values if column == "laser" else values.astype(np.int32)
                    objects.append(ChannelObject("Run", name, data, {**step, "unit_string": unit}))
            writer.write_segment(objects)
    return f"confirm = true\n{VALUES}"


def mdf(folder: Path, logs: Sequence[RigLog]) -> str:
    """MDF 4 of a vehicle's recorder: the drive's speed in revolutions per minute, the laser as a length."""
    from asammdf import MDF, Signal

    for log in logs:
        shown = 10.0 * (log.columns["laser"] - 5.0)  # mm
        signals = [
            Signal(shown, log.time, unit="mm", name="Laser_Weg"),
            Signal(log.columns["encoder_count"].astype(np.int64), log.time, unit="", name="Geber_Scheibe"),
        ]
        if "drive0_count" in log.columns:
            signals.append(Signal(_rpm(log), log.time, unit="rpm", name="Antrieb_Drehzahl"))
        with MDF(version="4.10") as file:
            file.append(signals, comment="bench")
            file.save(folder / f"{log.name}.mf4", overwrite=True)
    return f'confirm = true\n[values]{CONSTANTS}encoder = "1000"\n'


def _rpm(log: RigLog) -> np.ndarray:
    """The drive's speed as a recorder derives it from its encoder: over 0.2 s around each sample."""
    edge, count = log.columns["drive0_edge_time"], log.columns["drive0_count"]
    first = np.unique(edge, return_index=True)[1]
    angle = np.interp(log.time, edge[first], count[first] * 2 * np.pi / 1000)
    reach = 100
    padded = np.pad(angle, reach, mode="reflect", reflect_type="odd")
    return (padded[2 * reach :] - padded[: -2 * reach]) / (2 * reach * 0.001) * 30 / np.pi


def signals(folder: Path, logs: Sequence[RigLog]) -> str:
    """One file per signal, numbers alone."""
    names = {"time": "zeit.t", "laser": "weg.dat", "encoder_count": "scheibe.dat", "drive0_count": "antrieb.dat"}
    for log in logs:
        for column, file in names.items():
            values = log.time if column == "time" else log.columns.get(column)
            if values is not None:
                np.savetxt(folder / f"{log.name}_{file}", values, fmt="%.9g")
    return (
        'confirm = true\n[columns]\n"*_zeit.t" = "time s"\n"*_weg.dat" = "laser V"\n'
        f'"*_scheibe.dat" = "encoder_count"\n"*_antrieb.dat" = "drive0_count"\n{VALUES}'
    )


def two_recorders(folder: Path, logs: Sequence[RigLog]) -> str:
    """Laser on one recorder, encoders on another, which began later and whose clock runs slower."""
    for log in logs:
        with open(folder / f"{log.name}_laser.csv", "w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["time [s]", "laser [V]"])
            writer.writerows([f"{t:.6f}", f"{v:.4f}"] for t, v in zip(log.time, log.columns["laser"], strict=True))
        # t_first = OFFSET + (1 + DRIFT) t_second
        other = (log.time - OFFSET) / (1 + DRIFT)
        later = other >= 0
        count = {name: log.columns[name] for name in ("encoder_count", "drive0_count") if name in log.columns}
        with open(folder / f"{log.name}_encoders.csv", "w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["time [s]", *count])
            for i in np.flatnonzero(later):
                writer.writerow([f"{other[i]:.7f}", *(int(v[i]) for v in count.values())])
    return f'confirm = true\njoin = "clocks"\n{VALUES}'


RECORDERS: Mapping[str, Callable[[Path, Sequence[RigLog]], str]] = {
    one.__name__: one for one in (semicolons, lvm, tdms, mdf, signals, two_recorders)
}


def record(folder: Path, name: str, logs: Sequence[RigLog]) -> Path:
    """The logs as one recorder leaves them, and the answers; the folder of the recorder."""
    place = folder / name
    place.mkdir(parents=True)
    text = RECORDERS[name](place, [replace(log) for log in logs])
    (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return place


if __name__ == "__main__":
    made = bench()
    for recorder in RECORDERS:
        print(record(Path(sys.argv[1]), recorder, made))
