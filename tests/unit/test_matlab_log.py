"""MATLAB files: what is read, and what each thing that is no vector of numbers is answered with."""

from __future__ import annotations

import contextlib
import json
import struct
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat
from scipy.sparse import csr_array

from fmu_models.base.errors import StickslipError
from rig_io.logs.log import StickslipWarning
from rig_io.logs.mat5 import HEADER
from rig_io.packages.datapackage import read_log
from rig_io.readers import matlab_log, read_table

SHARED = Path(__file__).parents[3] / "shared" / "data"
TIME = 0.001 * np.arange(30)


def saved(folder: Path, **variables: object) -> Path:
    path = folder / "log.mat"
    savemat(path, variables)
    return path


def test_vectors_of_any_shape_and_type_become_columns_and_single_numbers_stay_apart(tmp_path: Path) -> None:
    counts = np.arange(30, dtype=np.uint16)[::-1]
    path = saved(tmp_path, t=TIME[:, None], count=counts[None, :], ok=counts > 3, gain=np.float32(0.5), n=np.uint8(7))
    table = read_table(path)
    assert list(table.columns) == ["t", "count", "ok"] and dict(table.scalars) == {"gain": 0.5, "n": 7.0}
    assert all(values.dtype == np.float64 and values.shape == (30,) for values in table.columns.values())
    # unsigned counts would wrap here
    np.testing.assert_array_equal(np.diff(table.columns["count"]), -1.0)
    assert table.place(0) == "sample 1"


def test_a_struct_stands_for_its_fields(tmp_path: Path) -> None:
    table = read_table(saved(tmp_path, s={"time": TIME, "x": TIME**2, "rate": 1000.0, "inner": {"a": TIME}}))
    assert list(table.columns) == ["time", "x"] and dict(table.scalars) == {"rate": 1000.0}
    assert "struct inside a struct" in table.left_out["inner"]


LEFT_OUT = {
    "cells": (np.array([TIME, "b"], dtype=object), "a cell array"),
    "text": ("recorded on Monday", "text"),
    "complex numbers": (TIME + 1j, "complex"),
    "sparse": (csr_array(np.eye(30)), "sparse"),
    "matrix": (np.ones((30, 2)), "matrix of 30 x 2"),
    "empty": (np.zeros((0, 0)), "empty"),
    "array of structs": (np.zeros(3, dtype=[("a", "f8")]), "struct inside a struct, or an array"),
}


@pytest.mark.parametrize(("value", "reason"), LEFT_OUT.values(), ids=LEFT_OUT)
def test_what_is_no_vector_is_left_out_with_the_reason(value: object, reason: str, tmp_path: Path) -> None:
    assert reason in read_table(saved(tmp_path, t=TIME, laser=value)).left_out["laser"]
    with pytest.raises(StickslipError, match=rf"no vector of numbers \('laser' is .*{reason}"):
        read_table(saved(tmp_path, laser=value))


REFUSED = {
    "different lengths": ({"t": TIME, "x": TIME[:7]}, "different lengths: 't' 30, 'x' 7"),
    "one name twice": ({"t": TIME, "s": {"t": TIME}}, "two columns named 't'"),
    "nothing": ({}, r"no vector of numbers\. Save"),
    "single numbers": ({"gain": 2.0}, "no vector of numbers"),
}


@pytest.mark.parametrize(("variables", "message"), REFUSED.values(), ids=REFUSED)
def test_files_without_one_table_are_refused(variables: dict, message: str, tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match=message):
        read_table(saved(tmp_path, **variables))


def test_the_other_byte_order_is_read(tmp_path: Path) -> None:
    name = struct.pack(">I4s", 1 << 16 | 1, b"t")  # short form: length and type in one word
    flags = struct.pack(">IIII", 6, 8, 6, 0) + struct.pack(">IIii", 5, 8, 3, 1)
    body = flags + name + struct.pack(">II3d", 9, 24, 0.0, 0.5, 1.0)
    path = tmp_path / "log.mat"
    path.write_bytes(b"MATLAB 5.0".ljust(124) + b"\x01\x00MI" + struct.pack(">II", 14, len(body)) + body)
    np.testing.assert_array_equal(read_table(path).columns["t"], [0.0, 0.5, 1.0])


def test_files_of_other_kinds_are_named(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["t"] = TIME
    with pytest.raises(StickslipError, match=r"version 7\.3 \(HDF5\).*'-v7'"):
        read_table(path)
    savemat(path, {"t": TIME}, format="4")
    with pytest.raises(StickslipError, match=r"no MATLAB file of version 5 to 7\.2"):
        read_table(path)
    path.write_text("# Created by Octave 9\n# name: t\n")
    with pytest.raises(StickslipError, match="In MATLAB or Octave save it with -v7"):
        read_table(path)


def test_dimensions_and_lengths_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    path = saved(tmp_path, t=TIME[:, None])
    data = path.read_bytes()
    path.write_bytes(data.replace(struct.pack("<ii", 30, 1), struct.pack("<ii", 31, 1), 1))
    with pytest.raises(StickslipError, match="'t' holds 30 numbers where its dimensions say 31"):
        read_table(path)
    path.write_bytes(data[:-8])
    with pytest.raises(StickslipError, match="it ends within an element"):
        read_table(path)


def test_a_file_cut_anywhere_is_refused(tmp_path: Path) -> None:
    data = saved(tmp_path, t=TIME, x=TIME).read_bytes()
    path = tmp_path / "cut.mat"
    for length in (50, HEADER, HEADER + 20, len(data) // 2, len(data) - 3):
        path.write_bytes(data[:length])
        with pytest.raises(StickslipError, match=r"damaged or cut off|no MATLAB file|no vector"):
            read_table(path)


names = st.from_regex(r"[a-z][a-z0-9_]{0,20}", fullmatch=True)
kinds = st.sampled_from([np.float64, np.float32, np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32])


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_any_table_survives_the_file(tmp_path_factory, data) -> None:
    rows = data.draw(st.integers(2, 30))
    columns = {}
    for name in data.draw(st.lists(names, min_size=1, max_size=4, unique=True)):
        kind = data.draw(kinds)
        bits = data.draw(st.binary(min_size=8 * rows, max_size=8 * rows))
        columns[name] = np.frombuffer(bits, dtype=kind)[:rows]
    path = tmp_path_factory.getbasetemp() / "any.mat"
    savemat(path, columns, do_compression=data.draw(st.booleans()))
    table = read_table(path)
    assert set(table.columns) == set(columns)
    for name, values in columns.items():
        with np.errstate(invalid="ignore"):  # NaN of any bits are drawn
            np.testing.assert_array_equal(table.columns[name], values.astype(np.float64))
    matlab_log.write(path, table.columns)
    for name, values in read_table(path).columns.items():
        np.testing.assert_array_equal(values, table.columns[name])


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_no_damage_breaks_the_reader(tmp_path_factory, data) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.mat"
    variables = {"t": TIME, "s": {"x": np.arange(30, dtype=np.int16), "note": "text"}, "c": np.array([1, "a"], object)}
    savemat(path, variables, do_compression=data.draw(st.booleans()))
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        spot = data.draw(st.integers(HEADER, len(content)))
        junk = data.draw(st.binary(max_size=8))
        content[spot : spot + data.draw(st.integers(0, 12))] = junk
    path.write_bytes(bytes(content))
    with contextlib.suppress(StickslipError):
        table = read_table(path)
        assert len({len(values) for values in table.columns.values()}) == 1


def test_a_rig_log_may_be_a_matlab_file(tmp_path: Path) -> None:
    laser = 5.0 + np.sin(40 * TIME)
    saved(tmp_path, time=TIME, laser=laser)
    units = [{"name": "time", "unit": "s"}, {"name": "laser", "unit": "V"}]
    resource = {"path": "log.mat", "schema": {"fields": units}, "calibration": {"laser": {"gain": 0.01, "zero": 5.0}}}
    sidecar = tmp_path / "datapackage.json"
    sidecar.write_text(json.dumps({"resources": [resource]}))
    log = read_log(tmp_path / "log.mat")
    np.testing.assert_array_equal(log.time, TIME)
    np.testing.assert_array_equal(log.column("laser"), laser)
    laser[7] = np.inf
    saved(tmp_path, time=TIME, laser=laser)
    with pytest.warns(StickslipWarning, match=r"'laser' has 1 cells without a number .* sample 8"):
        assert np.isnan(read_log(tmp_path / "log.mat").column("laser")[7])
    resource.pop("schema")
    sidecar.write_text(json.dumps({"resources": [resource]}))
    with pytest.raises(
        StickslipError, match=r"'time' has no unit\. Add \"unit\": \"s\" to its field in [a-z.]*json\.$"
    ):
        read_log(tmp_path / "log.mat")
    saved(tmp_path, time=TIME, laser="5.1 5.2")
    with pytest.raises(StickslipError, match=r"'laser' is text"):
        read_log(tmp_path / "log.mat")


@pytest.mark.parametrize(
    ("file", "columns", "rows", "scalars"),
    [
        ("emps/DATA_EMPS.mat", {"t", "qm", "qg", "vir"}, 24841, {"gtau", "kp", "kv"}),
        ("lyon_stickslip/k168Nm_v42.mat", {"t", "Fnorm"}, 751281, set()),
    ],
)
def test_recorded_files_are_read(file: str, columns: set[str], rows: int, scalars: set[str]) -> None:
    if not (SHARED / file).exists():
        pytest.skip(f"{file} is not at hand")
    table = read_table(SHARED / file)
    assert set(table.columns) == columns and set(table.scalars) == scalars
    assert all(len(values) == rows and np.isfinite(values).all() for values in table.columns.values())
