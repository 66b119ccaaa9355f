"""Tables that a class names by its columns."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from fmu_models.base.shown import Tabular

POINTS = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])


@dataclass(frozen=True, eq=False)
class Followed(Tabular):
    COLUMNS: ClassVar = (
        *("[time]=times", "{over}=values", "{states}=points", "{states}_to=intervals.1"),
        *("stable", "multiplier{}=multipliers"),
    )

    over: str = "omega"
    states: tuple[str, ...] = ("x", "v")
    times: Any = field(default_factory=lambda: np.array([0.0, 0.5, 1.0]))
    values: Any = field(default_factory=lambda: np.array([7.0, 8.0, 9.0]))
    points: Any = field(default_factory=lambda: POINTS)
    intervals: Any = None
    stable: Any = field(default_factory=lambda: np.array([True, False, True]))
    multipliers: Any = field(default_factory=lambda: np.array([[1.0 + 2.0j], [3.0], [4.0]]))


@dataclass(frozen=True, eq=False)
class Gridded(Tabular):
    COLUMNS: ClassVar = ("{axes}=axes", "attractor=labels")

    axes: Any = field(default_factory=lambda: {"x": np.array([1.0, 2.0]), "v": np.array([3.0, 4.0, 5.0])})
    labels: Any = field(default_factory=lambda: np.arange(6).reshape(2, 3))


def test_names_are_those_that_the_value_says_in_the_order_of_the_class():
    frame = Followed().frame
    assert list(frame) == ["omega", "x", "v", "stable", "multiplier1_real", "multiplier1_imag"]
    assert frame.index.name == "time" and frame.index.tolist() == [0.0, 0.5, 1.0]
    assert frame["v"].tolist() == [2.0, 4.0, 6.0] and frame["stable"].dtype == bool
    assert frame["multiplier1_imag"].tolist() == [2.0, 0.0, 0.0]


def test_one_side_of_an_interval_makes_columns_where_there_is_one():
    frame = Followed(intervals=np.stack([POINTS, 10.0 * POINTS], axis=1)).frame
    assert frame["x_to"].tolist() == [10.0, 30.0, 50.0] and frame["v_to"].tolist() == [20.0, 40.0, 60.0]


def test_a_grid_has_one_row_per_node_the_first_axis_slowest():
    frame = Gridded().frame
    assert frame["x"].tolist() == [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]
    assert frame["v"].tolist() == [3.0, 4.0, 5.0, 3.0, 4.0, 5.0]
    assert frame["attractor"].tolist() == [0, 1, 2, 3, 4, 5]


def test_a_class_without_columns_says_what_to_write():
    class Bare(Tabular): ...

    with pytest.raises(StickslipError, match=r"Name its columns in Bare\.COLUMNS"):
        _ = Bare().frame
