"""Trajectories in files: what is written is read back to the last bit, and nothing is left half-written."""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from fmu_models.base.errors import StickslipError
from fmu_models.codegen.package import built
from fmu_models.fmu.fmu import Fmu
from fmu_models.simulation import results
from fmu_models.simulation.results import Provenance, read_trajectory, write_trajectory
from fmu_models.simulation.run import simulate
from fmu_models.simulation.trajectory import Event, ForeignEvent, Trajectory

# what XML allows in a name: neither NUL nor halves of surrogate pairs
TEXT = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=12)
NUMBERS = st.floats(allow_nan=True, allow_infinity=True)
DTYPES = st.sampled_from([np.float64, np.float32, np.int8, np.int32, np.uint64, np.int64, np.bool_])


@st.composite
def trajectories(draw: st.DrawFn) -> Trajectory:
    n = draw(st.integers(0, 20))
    names = draw(
        st.lists(TEXT | st.sampled_from([".", "..", "a/b", "a%2Fb", "", "/", "der(x)"]), unique=True, max_size=6)
    )
    column = DTYPES.flatmap(lambda dtype: arrays.arrays(dtype, n))
    event = st.builds(Event, NUMBERS, TEXT, st.integers(-1, 4), st.integers(-1, 4))
    states = st.tuples(*[NUMBERS] * draw(st.integers(0, 3)))
    kinds = st.sampled_from(["state", "time", "slide"])
    foreign = st.builds(ForeignEvent, NUMBERS, kinds, st.integers(-1, 9), TEXT, NUMBERS, NUMBERS, states, states)
    return Trajectory(
        draw(arrays.arrays(np.float64, n)),
        {name: draw(column) for name in names},
        {name: draw(TEXT) for name in names},
        tuple(draw(st.lists(event, max_size=5) | st.lists(foreign, max_size=5))),
        draw(st.integers(0, 1 << 40)),
        draw(st.integers(0, 1 << 40)),
        draw(TEXT),
    )


SETTINGS = st.dictionaries(TEXT, NUMBERS, max_size=4)
PROVENANCES = st.builds(
    Provenance, TEXT, TEXT, TEXT, TEXT, TEXT, TEXT, TEXT, *[NUMBERS] * 4, TEXT, SETTINGS, SETTINGS, SETTINGS
)


def same(one: Any, two: Any) -> bool:
    """Equal with the same types, not-a-number being equal to itself."""
    if isinstance(one, np.ndarray):
        return one.dtype == two.dtype and one.tobytes() == two.tobytes()
    return repr(one) == repr(two)


_numbers = itertools.count()


@pytest.mark.nightly
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(trajectories(), PROVENANCES | st.none(), st.data())
def test_reading_gives_what_was_written(
    tmp_path: Path, given_one: Trajectory, provenance: Provenance | None, data: st.DataObject
) -> None:
    descriptions = {name: data.draw(TEXT) for name in list(given_one.values)[::2]}
    path = tmp_path / f"{next(_numbers)}.h5"
    write_trajectory(given_one, path, provenance=provenance, descriptions=descriptions)
    read = read_trajectory(path)
    assert list(read.trajectory.values) == list(given_one.values)
    assert all(same(given_one.values[name], read.trajectory.values[name]) for name in given_one.values)
    assert same(given_one.time, read.trajectory.time)
    for name in ("units", "events", "steps", "evaluations", "method"):
        assert same(getattr(given_one, name), getattr(read.trajectory, name))
    assert read.descriptions == descriptions
    assert same(provenance, read.provenance)


@pytest.fixture(scope="module")
def run() -> tuple[Fmu, Trajectory]:
    fmu = Fmu.open(built("block_on_belt"))
    return fmu, simulate(fmu, 5.0, parameters={"m": 1.5})


def test_a_run_with_all_that_is_known_of_it(run: tuple[Fmu, Trajectory], tmp_path: Path) -> None:
    fmu, trajectory = run
    path = tmp_path / "run.h5"
    origin = Provenance.of(fmu, "taylor", 0.0, 5.0, tolerance=1e-14, parameters={"m": 1.5})
    described = {name: str(v.description) for name, v in fmu.variables.items() if v.description}
    write_trajectory(trajectory, path, provenance=origin, descriptions=described)
    read = read_trajectory(path)
    assert read.trajectory.events == trajectory.events
    assert read.trajectory.events
    assert read.provenance
    assert read.provenance.sha256 == hashlib.sha256(fmu.path.read_bytes()).hexdigest()
    assert read.provenance.token == fmu.description.guid
    assert dict(read.provenance.parameters) == {"m": 1.5}
    assert repr(read.provenance) == repr(origin)
    # as somebody reads it who knows HDF5 alone
    with h5py.File(path) as file:
        data: Any = file["values/x"]
        assert (data.attrs["unit"], data.attrs["description"]) == ("m", fmu.variables["x"].description)
        assert np.array_equal(data[()], trajectory["x"])
        assert np.array_equal(file["events/time"][()], [event.time for event in trajectory.events])  # type: ignore
        assert file["provenance"].attrs["fmi_version"] == "3.0"
        assert list(file["values"]) == list(trajectory.values)  # type: ignore[arg-type]


def test_csv_has_the_variables_and_their_units(run: tuple[Fmu, Trajectory], tmp_path: Path) -> None:
    _, trajectory = run
    write_trajectory(trajectory, tmp_path / "run.csv")
    read = np.genfromtxt(tmp_path / "run.csv", delimiter=",", names=True, deletechars="")
    assert read.dtype.names and read.dtype.names[:3] == ("time_[s]", "v_belt_[m/s]", "x_[m]")
    assert np.array_equal(read["x_[m]"], trajectory["x"])


def test_what_cannot_be_written(run: tuple[Fmu, Trajectory], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _, trajectory = run
    with pytest.raises(StickslipError, match=r"must end in one of \.csv"):
        write_trajectory(trajectory, tmp_path / "run.mat")
    (tmp_path / "run.h5").write_text("mine")
    with pytest.raises(StickslipError, match="exists already"):
        write_trajectory(trajectory, tmp_path / "run.h5")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(results, "_write", full)
    with pytest.raises(StickslipError, match="No space left on device"):
        write_trajectory(trajectory, tmp_path / "run.h5", overwrite=True)
    assert [file.name for file in tmp_path.iterdir()] == ["run.h5"]
    assert (tmp_path / "run.h5").read_text() == "mine"


@pytest.mark.nightly
def test_what_cannot_be_read(run: tuple[Fmu, Trajectory], tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with pytest.raises(StickslipError, match="no file"):
        read_trajectory(path)
    path.write_text("hello")
    with pytest.raises(StickslipError, match="cannot be read"):
        read_trajectory(path)
    (tmp_path / "run.csv").write_text("time [s]\n")
    with pytest.raises(StickslipError, match=r"write the run as \.h5"):
        read_trajectory(tmp_path / "run.csv")
    write_trajectory(run[1], path, overwrite=True)
    for change, said in (
        (lambda f: f.attrs.update(version=99), "another version"),
        (lambda f: f.attrs.update(format="other"), "not a trajectory"),
        (lambda f: f.__delitem__("events"), "cannot be read as a trajectory"),
        (lambda f: (f.__delitem__("time"), f.__setitem__("time", 1.0)), "every variable needs a number at each time"),
        (lambda f: (f.__delitem__("time"), f.__setitem__("time", ["a", "b"])), "cannot be read as a trajectory"),
        (lambda f: f["events"].attrs.update(kind="os.system"), "cannot be read as a trajectory"),
    ):
        copy = tmp_path / "copy.h5"
        copy.write_bytes(path.read_bytes())
        with h5py.File(copy, "r+") as file:
            change(file)
        with pytest.raises(StickslipError, match=said):
            read_trajectory(copy)
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(StickslipError, match="cannot be read"):
        read_trajectory(path)


def test_an_event_of_any_fmu_is_told_in_a_line() -> None:
    of_wall = ForeignEvent(1.5, "state", 2, "wall", -1.0, 0.0, (), ())
    assert str(of_wall) == "1.5 s: state of indicator 2 (wall)"
    assert str(dataclasses.replace(of_wall, name="")) == "1.5 s: state of indicator 2"
    assert str(ForeignEvent(2.0, "time", -1, "", 0.0, 0.0, (), (), "fast")) == "2 s: time, fast ticks"


def test_long_texts_are_cut(run: tuple[Fmu, Trajectory], tmp_path: Path) -> None:
    fmu, trajectory = run
    origin = dataclasses.replace(Provenance.of(fmu, "taylor", 0.0, 5.0), generation_tool="\u20ac" * 100_000)
    write_trajectory(trajectory, tmp_path / "run.h5", provenance=origin, descriptions={"x": "y" * 100_000})
    read = read_trajectory(tmp_path / "run.h5")
    assert read.provenance
    assert (len(read.descriptions["x"]), len(read.provenance.generation_tool)) == (8192, 8192)
