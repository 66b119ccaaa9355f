"""Tables of a calibration: what is left of each series, in its unit and as a part of the motion."""

from __future__ import annotations

from identification.calibration.result import SeriesResidual
from identification.report.calibration_summary import residuals_table


def test_what_is_left_of_a_series_is_told_in_its_unit_and_in_percent_of_the_motion() -> None:
    table = residuals_table(
        [
            SeriesResidual("a.csv", "angle", "rad", 1200, 0.0125, 0.05, 0.3, 0.004, 2),
            SeriesResidual("b.csv", "event 3", "s", 12, 0.001, None, 0.0, 0.5, 0, held_out=True),
        ]
    )
    assert [[cell.words for cell in row] for row in table.rows] == [
        ["a.csv", "angle", "1200", "0.0125", "rad", "5", "0.30", "0.004", "2"],
        ["b.csv (held out)", "event 3", "12", "0.001", "s", "", "0.00", "0.5", "0"],
    ]
    assert [column.words for column in table.columns][3:6] == ["rms", "unit", "of the motion (%)"]
