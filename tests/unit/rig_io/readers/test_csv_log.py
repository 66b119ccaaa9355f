"""Reading a log: what is accepted, and what each fault of a file is answered with."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kept_log import CALIBRATION, RIG, a_log, edit_sidecar

from fmu_models.base.errors import StickslipError, StickslipWarning
from rig_io.logs.log import Experiment, RigLog
from rig_io.packages.datapackage import read_columns, read_log, read_package, write_package


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return write_package(tmp_path / "logs", [a_log()])


def edit_csv(package: Path, edit) -> None:
    """Change the text of the log by a function, and drop its checksum."""
    path = package / "a.csv"
    path.write_text(edit(path.read_text()))
    edit_sidecar(package, lambda content: content["resources"][0].pop("hash", None))


def test_round_trip_keeps_everything(package: Path) -> None:
    log, written = read_log(package / "a.csv"), a_log()
    np.testing.assert_allclose(log.time, written.time, rtol=0, atol=5e-10)
    for name, values in written.columns.items():
        np.testing.assert_array_equal(log.column(name), values)
    assert (log.rig, log.calibration, log.experiment) == (RIG, CALIBRATION, written.experiment)
    assert log.units == {"time": "s", "laser": "V", "encoder_count": "1", "encoder_edge_time": "s"}


@settings(max_examples=25, deadline=None)
@given(start=st.floats(-100, 100), steps=st.lists(st.floats(1e-4, 0.4), min_size=9, max_size=40), data=st.data())
def test_any_log_survives_the_file(tmp_path_factory, start: float, steps: list[float], data) -> None:
    time = np.round(start + np.concatenate([[0.0], np.cumsum(steps)]), 9)
    exact = st.lists(st.floats(-1e30, 1e30), min_size=len(time), max_size=len(time))
    edges = st.lists(st.integers(-3, 3), min_size=len(time), max_size=len(time))
    count = data.draw(st.integers(-(2**50), 2**50)) + np.cumsum(data.draw(edges))
    columns = {"laser": np.array(data.draw(exact)), "encoder_count": count.astype(float)}
    log = RigLog("x", time, columns, {}, RIG, CALIBRATION, Experiment())
    (back,) = read_package(write_package(tmp_path_factory.mktemp("any") / "p", [log]))
    np.testing.assert_array_equal(back.time, time)
    for name, values in columns.items():
        np.testing.assert_array_equal(back.column(name), values)


ACCEPTED = {
    "byte-order mark": lambda text: "\ufeff" + text,
    "semicolons and decimal commas": lambda text: text.replace(",", ";").replace(".", ","),
    "tabs": lambda text: text.replace(",", "\t"),
    "Windows line ends": lambda text: text.replace("\n", "\r\n"),
    "blank lines at the end": lambda text: text + "\n\n",
    "row of units": lambda text: text.replace("\n", "\ns,V,1,s\n", 1),
    "units in the header": lambda text: text.replace("time,laser", "time [s],laser [V]"),
    "a column without a name": lambda text: "\n".join(
        f"{line}," if i == 0 else f"{line},3" for i, line in enumerate(text.splitlines())
    ),
    "lines above the header": lambda text: "Recorder 7\nGain: 3 mV\n\n" + text,
    "quotation marks": lambda text: "\n".join(
        ",".join(f'"{cell}"' for cell in line.split(",")) for line in text.splitlines()
    ),
    "an unknown column": lambda text: "\n".join(
        line + (",lab_temperature" if line.startswith("time") else ",21.5") for line in text.splitlines()
    ),
}


@pytest.mark.parametrize("change", ACCEPTED.values(), ids=ACCEPTED)
def test_variants_of_csv_read_the_same(package: Path, change) -> None:
    plain = read_log(package / "a.csv")
    edit_csv(package, change)
    log = read_log(package / "a.csv")
    np.testing.assert_array_equal(log.time, plain.time)
    for name in plain.columns:
        np.testing.assert_allclose(log.column(name), plain.column(name), rtol=1e-15)


def line(number: int, new: str):
    """An edit that replaces one line (counted from 1)."""

    def edit(text: str) -> str:
        lines = text.splitlines()
        lines[number - 1] = new
        return "\n".join(lines) + "\n"

    return edit


def cell(number: int, column: int, new: str):
    """An edit that replaces one cell of a line (both counted from 1)."""
    return lambda text: line(number, cell_of(text.splitlines()[number - 1], column, new))(text)


def cell_of(row: str, column: int, new: str) -> str:
    cells = row.split(",")
    cells[column - 1] = new
    return ",".join(cells)


REFUSED = {
    "empty": (lambda text: "\n", "is empty"),
    "header alone": (lambda text: text.splitlines()[0], "no rows"),
    "no header": (lambda text: text.split("\n", 1)[1], "begins with numbers"),
    "misspelt time": (lambda text: text.replace("time,", "tiem,", 1), "lacks 'time'.*Did you mean 'tiem'"),
    "no angle": (lambda text: text.replace("laser", "lasso").replace("encoder_count", "count"), "lacks one source"),
    "edge times without count": (lambda text: text.replace("encoder_count", "count"), "lacks 'encoder_count'"),
    "doubled name": (lambda text: text.replace("laser", "time"), "two columns named 'time'"),
    "column without numbers": (
        lambda text: "\n".join(cell_of(line, 2, "OVER" if i else "laser") for i, line in enumerate(text.splitlines())),
        "column 'laser' holds no number",
    ),
    "falling time": (cell(17, 1, "0.001"), "falls .* line 17 .*--repair sort"),
    "repeated time": (cell(18, 1, "0.015"), "line 18 repeats the time 0.015 .*--repair duplicates"),
    "word": (cell(9, 3, "five"), "line 9, column 'encoder_count' holds 'five'"),
    "extra cell": (
        lambda text: line(7, text.splitlines()[6] + ",1")(text),
        r"line 7 has 5 cells, the header has 4\. Mend or remove",
    ),
    "blank line inside": (line(7, ""), "line 7 has 1 cells"),
    "decimal commas between commas": (
        lambda text: text.split("\n", 1)[0] + "\n" + text.split("\n", 1)[1].replace(".", ","),
        "line 2 has .* needs ';'",
    ),
    "fraction of a count": (cell(5, 3, "1.5"), "counts edges, but line 5 holds 1.5"),
    "edge time ahead of its tick": (cell(40, 4, "9.0"), "'encoder_edge_time' runs ahead of the tick on line 40"),
    "falling edge time": (cell(40, 4, "0.001"), "'encoder_edge_time' falls on line 40"),
    "edge without a new time": (cell(41, 4, "0.0376"), "'encoder_edge_time' .* line 41"),
    "too short": (lambda text: "\n".join(text.splitlines()[:5]) + "\n", "too short: 4 rows"),
    "binary": (lambda text: text.replace("\n", "\0\n"), "zero bytes"),
}


@pytest.mark.parametrize(("change", "message"), REFUSED.values(), ids=REFUSED)
def test_a_faulty_file_is_refused_with_its_place(package: Path, change, message: str) -> None:
    edit_csv(package, change)
    with pytest.raises(StickslipError, match=message):
        read_log(package / "a.csv")


def test_a_row_torn_off_at_the_end_is_left_out_with_a_warning(package: Path) -> None:
    for torn in ("0.0500,5.1", "0.0500,5.1,1,"):
        edit_csv(package, lambda text, torn=torn: "\n".join(text.splitlines()[:51]) + "\n" + torn)
        with pytest.warns(StickslipWarning, match="line 52 is cut off"):
            log = read_log(package / "a.csv")
        assert len(log.time) == 50


@pytest.mark.parametrize("encoding", ["latin-1", "cp1252", "utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_text_of_any_encoding_is_read(package: Path, encoding: str) -> None:
    plain = read_log(package / "a.csv")
    name = "Gr\N{LATIN SMALL LETTER O WITH DIAERESIS}\N{LATIN SMALL LETTER SHARP S}e"
    text = (package / "a.csv").read_text().replace("time,", f"{name} [\N{MICRO SIGN}m],time,", 1)
    head, rest = text.split("\n", 1)
    edit_csv(package, lambda text: text)
    (package / "a.csv").write_bytes("\n".join([head, *(f"1,{line}" for line in rest.splitlines())]).encode(encoding))
    log = read_log(package / "a.csv")
    np.testing.assert_array_equal(log.column("laser"), plain.column("laser"))
    assert name in read_columns(package / "a.csv").columns


def test_bytes_that_are_no_text_in_a_stated_encoding_are_named(package: Path) -> None:
    edit_csv(package, lambda text: text)

    def as_wide(content) -> None:
        content["resources"][0]["dialect"] = {"encoding": "utf-16"}

    edit_sidecar(package, as_wide)
    with pytest.raises(StickslipError, match="stickslip describe FILE --read"):
        read_log(package / "a.csv")


@settings(max_examples=100, deadline=None)
@given(
    spot=st.integers(0, 1500),
    length=st.integers(0, 40),
    junk=st.binary(max_size=6)
    | st.sampled_from([b",", b"\n", b"\n\n", b'"', b";", b"-", b"e", b"nan", b"\xef\xbb\xbf"]),
)
def test_no_text_breaks_the_reader(tmp_path_factory, spot: int, length: int, junk: bytes) -> None:
    folder = tmp_path_factory.getbasetemp() / "any-text"
    write_package(folder, [a_log()], overwrite=True)
    edit_csv(folder, lambda text: text)
    data = (folder / "a.csv").read_bytes()
    (folder / "a.csv").write_bytes(data[:spot] + junk + data[spot + length :])
    with contextlib.suppress(StickslipError), warnings.catch_warnings():
        warnings.simplefilter("ignore", StickslipWarning)
        log = read_log(folder / "a.csv")
        assert np.all(np.diff(log.time) > 0) and all(len(values) == len(log.time) for values in log.columns.values())


def test_files_that_are_not_there(package: Path, tmp_path: Path) -> None:
    with pytest.raises(StickslipError, match=r"no log .*b\.csv'.*Did you mean 'a\.csv'"):
        read_log(package / "b.csv")
    with pytest.raises(StickslipError, match=r"no log .*a\.doc'"):
        read_log(package / "a.doc")
    (package / "a.doc").write_text("PAR1")
    with pytest.raises(StickslipError, match="no known kind"):
        read_log(package / "a.doc")
    with pytest.raises(StickslipError, match="is a package of logs"):
        read_log(package)
    with pytest.raises(StickslipError, match=r"no datapackage\.json in"):
        read_package(tmp_path)
    (package / "datapackage.json").write_text("{")
    with pytest.raises(StickslipError, match="is not JSON"):
        read_log(package / "a.csv")
    (package / "datapackage.json").unlink()
    with pytest.raises(StickslipError, match="the rig's constants are unknown"):
        read_log(package / "a.csv")


def test_a_log_without_sidecar_needs_units_and_the_rig(tmp_path: Path) -> None:
    path = tmp_path / "own.csv"
    rows = [f"{10 * i},{10 * i},{60 / (2 * np.pi)}" for i in range(20)]
    path.write_text("\n".join(["time [ms],angle [mrad],drive0_speed [rpm]", *rows]))
    log = read_log(path, rig=RIG)
    np.testing.assert_allclose(log.time, 0.01 * np.arange(20))
    np.testing.assert_allclose(log.column("angle"), 0.01 * np.arange(20))
    np.testing.assert_allclose(log.column("drive0_speed"), 1.0)
    assert log.rig is RIG and log.contacts == ("disc0",)
    path.write_text(path.read_text().replace(" [mrad]", ""))
    with pytest.raises(StickslipError, match="'angle' has no unit"):
        read_log(path, rig=RIG)


def test_a_missing_constant_or_column_says_what_to_add(package: Path) -> None:
    log = read_log(package / "a.csv")
    with pytest.raises(StickslipError, match=r"constant k \[N\*m/rad\] is needed"):
        log.rig.value("k")
    with pytest.raises(StickslipError, match="no constant 'q'"):
        log.rig.value("q")
    with pytest.raises(StickslipError, match=r"no column 'lasr'.*'laser'"):
        log.column("lasr")


def test_importing_the_package_loads_nothing_heavy() -> None:
    heavy = "{'pandas', 'pint', 'scipy', 'sympy', 'fmpy', 'matplotlib'}"
    code = (
        f"import sys, rig_io.logs.log, rig_io.sensors, rig_io.bench.emulator; print(sorted(set(sys.modules) & {heavy}))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
