"""MATLAB files: what is read, and what each thing that is no vector of numbers is answered with."""

from __future__ import annotations

import json
import os
import struct
import sys
from pathlib import Path

import h5py
import isolated_functions
import numpy as np
import pytest
from checkout import ROOT
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat
from scipy.sparse import csr_array

from fmu_models.base.child_process import Limits
from fmu_models.base.errors import StickslipError, StickslipWarning
from fmu_models.base.processes import in_processes
from rig_io.logs.mat_file import arrays
from rig_io.logs.table import Table
from rig_io.packages.datapackage import read_log
from rig_io.readers import matlab_log, read_table
from rig_io.readers.matlab_log import HEADER

linux = pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux only")
posix = pytest.mark.skipif(os.name != "posix", reason="signals")
SHARED = ROOT.parent / "shared" / "data"
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


@pytest.mark.parametrize("side", [1, -1])
def test_the_only_matrix_is_a_log_without_names(side: int, tmp_path: Path) -> None:
    columns = np.column_stack([TIME, np.sin(TIME), np.cos(TIME)])
    table = read_table(saved(tmp_path, data=columns if side > 0 else columns.T, rate=50.0))
    assert table.nameless and list(table.columns) == ["column 1", "column 2", "column 3"]
    np.testing.assert_array_equal(np.column_stack(list(table.columns.values())), columns)
    assert table.scalars == {"rate": 50.0} and not table.left_out
    with pytest.raises(StickslipError, match=r"no vector of numbers.*'b' is a matrix"):
        read_table(saved(tmp_path, a=columns, b=columns))


@pytest.mark.parametrize(("value", "reason"), LEFT_OUT.values(), ids=LEFT_OUT)
def test_what_is_no_vector_is_left_out_with_the_reason(value: object, reason: str, tmp_path: Path) -> None:
    assert reason in read_table(saved(tmp_path, t=TIME, laser=value)).left_out["laser"]
    if reason.startswith("matrix"):  # the only one is the log
        return
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


def test_version_7_3_is_read(tmp_path: Path) -> None:
    """Written as MATLAB does: arrays transposed, classes as attributes, cells as references."""
    path = tmp_path / "log.mat"
    with h5py.File(path, "w", userblock_size=512) as file:

        def put(place: h5py.Group, name: str, kind: str, data: object, **attributes: object) -> None:
            made = place.create_dataset(name, data=data)
            made.attrs["MATLAB_class"] = np.bytes_(kind)
            made.attrs.update(attributes)

        put(file, "t", "double", TIME[None, :])
        put(file, "gain", "single", np.array([[0.5]], np.float32))
        put(file, "ok", "logical", np.arange(30, dtype=np.uint8)[:, None] % 2, MATLAB_int_decode=1)
        put(file, "note", "char", np.frombuffer(b"M\0o\0", np.uint16)[:, None], MATLAB_int_decode=2)
        put(file, "z", "double", np.ones((1, 30), dtype=[("real", "f8"), ("imag", "f8")]))
        put(file, "many", "double", np.ones((2, 30)))
        put(file, "nothing", "double", np.array([0, 0], np.uint64), MATLAB_empty=np.uint8(1))
        put(file.create_group("#refs#"), "a", "double", TIME[None, :])
        put(file, "cells", "cell", np.array([[file["#refs#/a"].ref]], dtype=h5py.ref_dtype))
        put(file.create_group("sparse"), "data", "double", TIME)
        file["sparse"].attrs.update(MATLAB_class=np.bytes_("double"), MATLAB_sparse=np.uint64(30))
        record = file.create_group("s")
        record.attrs["MATLAB_class"] = np.bytes_("struct")
        put(record, "x", "int16", np.arange(30, dtype=np.int16)[None, :])
        record.create_group("inner").attrs["MATLAB_class"] = np.bytes_("struct")
        put(file.create_group("array_of_structs"), "a", "", np.array([[file["t"].ref]] * 2, dtype=h5py.ref_dtype))
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    table = read_table(path)
    assert set(table.columns) == {"t", "ok", "x"} and dict(table.scalars) == {"gain": 0.5}
    np.testing.assert_array_equal(table.columns["t"], TIME)
    np.testing.assert_array_equal(table.columns["x"], np.arange(30))
    reasons = {
        "note": "text",
        "z": "complex",
        "many": "a matrix of 30 x 2",
        "nothing": "empty",
        "cells": "a cell array",
        "sparse": "a sparse",
        "inner": "a struct inside a struct",
        "a": "a struct inside a struct, or an array of them",
    }
    assert set(table.left_out) == set(reasons)
    assert all(reason in table.left_out[name] for name, reason in reasons.items())
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(StickslipError, match=r"damaged or cut off: .*truncated"):
        read_table(path)


def test_objects_are_left_out_by_their_own_names(tmp_path: Path) -> None:
    """MATLAB's tables have no name where other variables have theirs, and SciPy calls all of them None."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)

    number = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 1, 1)) + element(1, b"")
    path = saved(tmp_path, t=TIME)
    with path.open("ab") as file:
        for name in (b"first", b"second"):
            words = b"".join(element(1, word) for word in (name, b"MCOS", b"table"))
            content = element(14, number + element(6, struct.pack("<I", 5)))
            file.write(element(14, element(6, struct.pack("<II", 17, 0)) + words + content))
    table = read_table(path)
    assert list(table.columns) == ["t"] and set(table.left_out) == {"first", "second"}
    assert all("MATLAB object" in reason for reason in table.left_out.values())


def test_one_name_twice_is_refused_where_the_file_itself_has_it_twice(tmp_path: Path) -> None:
    data = saved(tmp_path, t=TIME).read_bytes()
    (tmp_path / "log.mat").write_bytes(data + data[HEADER:])
    with pytest.raises(StickslipError, match="two columns named 't'"):
        read_table(tmp_path / "log.mat")


def test_files_of_other_kinds_are_named(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    savemat(path, {"t": TIME}, format="4")
    with pytest.raises(StickslipError, match=r"no MATLAB file of version 5 or later"):
        read_table(path)
    path.write_text("# Created by Octave 9\n# name: t\n")
    with pytest.raises(StickslipError, match="In MATLAB or Octave save it with -v7"):
        read_table(path)


def test_dimensions_and_lengths_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    path = saved(tmp_path, t=TIME[:, None])
    data = path.read_bytes()
    path.write_bytes(data.replace(struct.pack("<ii", 30, 1), struct.pack("<ii", 31, 1), 1))
    with pytest.raises(StickslipError, match="variable 't': cannot reshape array of size 30 into shape"):
        read_table(path)
    path.write_bytes(data[:-8])
    with pytest.raises(StickslipError, match="variable 't': could not read bytes"):
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


def read_in_one_process(paths: list[Path]) -> list[Table | StickslipError]:
    """As ``read_table`` does, but for the process, which takes most of the time."""
    found: list[Table | StickslipError] = []
    jobs = [(str(path), False) for path in paths]
    for _, outcome in sorted(in_processes(arrays, jobs, processes=1, limits=Limits(60))):
        try:
            if isinstance(outcome, Exception):
                raise outcome
            found.append(matlab_log.table_of(paths[0], outcome))
        except StickslipError as error:
            found.append(error)
    return found


@settings(max_examples=2, deadline=None)
@given(data=st.data())
def test_any_table_survives_the_file(tmp_path_factory, data) -> None:
    folder = tmp_path_factory.mktemp("any")
    drawn = []
    for number in range(20):
        rows = data.draw(st.integers(2, 30))
        columns = {}
        for name in data.draw(st.lists(names, min_size=1, max_size=4, unique=True)):
            kind = data.draw(kinds)
            bits = data.draw(st.binary(min_size=8 * rows, max_size=8 * rows))
            columns[name] = np.frombuffer(bits, dtype=kind)[:rows]
        savemat(folder / f"{number}.mat", columns, do_compression=data.draw(st.booleans()))
        with np.errstate(invalid="ignore"):  # NaN of any bits are drawn
            drawn.append({name: values.astype(np.float64) for name, values in columns.items()})
        savemat(folder / f"{number}_again.mat", drawn[-1], oned_as="column")
    for suffix in (".mat", "_again.mat"):
        tables = read_in_one_process([folder / f"{number}{suffix}" for number in range(20)])
        for columns, table in zip(drawn, tables, strict=True):
            assert isinstance(table, Table) and set(table.columns) == set(columns)
            for name, values in columns.items():
                np.testing.assert_array_equal(table.columns[name], values)


@settings(max_examples=5, deadline=None)
@given(data=st.data())
def test_no_damage_breaks_the_reader(tmp_path_factory, data) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    variables = {"t": TIME, "s": {"x": np.arange(30, dtype=np.int16), "note": "text"}, "c": np.array([1, "a"], object)}
    paths = [folder / f"{i}.mat" for i in range(60)]
    for path in paths:
        savemat(path, variables, do_compression=data.draw(st.booleans()))
        content = bytearray(path.read_bytes())
        for _ in range(data.draw(st.integers(1, 4))):
            spot = data.draw(st.integers(HEADER, len(content)))
            junk = data.draw(st.binary(max_size=8))
            content[spot : spot + data.draw(st.integers(0, 12))] = junk
        path.write_bytes(bytes(content))
    for table in read_in_one_process(paths):
        assert isinstance(table, StickslipError) or len({len(values) for values in table.columns.values()}) == 1


@posix
def test_a_crash_while_reading_is_one_clear_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = saved(tmp_path, t=TIME)
    monkeypatch.setattr(matlab_log, "stored_arrays", isolated_functions.crash_on)
    with pytest.raises(StickslipError, match=r"log\.mat' is damaged, or unpacks .* crashed \(SIGSEGV.*Copy it again"):
        read_table(path)


@linux
def test_a_small_file_that_unpacks_to_too_much_is_one_clear_error(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    with h5py.File(path, "w") as file:  # nothing is written until a value is set
        file.create_dataset("t", (1, 1 << 31), "f8", chunks=(1, 1 << 16))
    assert path.stat().st_size < 10_000
    with pytest.raises(StickslipError, match=r"more than the 4096 MB of memory allowed"):
        read_table(path)


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
    with pytest.raises(StickslipError, match=r"'time' has no unit\. State it: stickslip describe .* COLUMN=s\.$"):
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
