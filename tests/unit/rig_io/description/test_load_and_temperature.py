"""Normal force and temperature beside the motion: proposed from names and units, kept, read in N and K."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fmu_models.base.errors import StickslipError
from fmu_models.base.unit_names import scale_of
from rig_io.description.answers import Answers
from rig_io.description.draft import draft, write
from rig_io.packages.datapackage import read_log

NO_ANSWERS = Answers()
DRIVEN = Answers(values={"drive0": "1000"}, confirm=True)


def logged(folder: Path, header: str, temperature: np.ndarray, load: np.ndarray) -> Path:
    """A log of an angle, a drive, a normal force and a temperature."""
    time = 0.001 * np.arange(len(load))
    columns = [time, 0.2 * np.sin(12 * time), np.floor(900 * time), load, temperature]
    path = folder / "run.csv"
    rows = "\n".join(",".join(f"{v:.9g}" for v in row) for row in zip(*columns, strict=True))
    path.write_text(f"{header}\n{rows}\n")
    return path


def rising(rows: int = 3000) -> tuple[np.ndarray, np.ndarray]:
    share = np.linspace(0, 1, rows)
    return 21 + 8 * share, 4 + np.sin(20 * share)


@pytest.mark.parametrize(
    ("load", "newton", "degrees", "kelvin"),
    [
        ("uN", 1e-6, "degC", 273.15),
        ("kgf", 9.80665, "°C", 273.15),
        ("lbf", 4.4482216152605, "C", 273.15),
        ("kN", 1000.0, "K", 0.0),
    ],
)
def test_both_are_found_and_read_in_newton_and_kelvin(
    tmp_path: Path, load: str, newton: float, degrees: str, kelvin: float
) -> None:
    warm, pressed = rising()
    path = logged(
        tmp_path, f"t [s],theta [rad],motor encoder,Fn [{load}],T_room [{degrees}]", warm + 250 * (not kelvin), pressed
    )
    found = draft([path], NO_ANSWERS)
    roles = {one.name: (one.role, one.unit) for one in found.logs[0].files[0].columns}
    assert roles["Fn"] == ("load0", load)
    assert roles["T_room"] == ("temperature", degrees)
    write(draft([path], DRIVEN))
    log = read_log(path)
    np.testing.assert_allclose(log.column("load0"), newton * np.round(pressed, 8), rtol=1e-7)
    np.testing.assert_allclose(log.column("temperature"), warm + (kelvin or 250), rtol=1e-7)


def test_fahrenheit_meets_celsius_where_both_freeze_and_boil() -> None:
    factor, zero = scale_of("degF", "K", "")
    assert factor * np.array([32.0, 212.0, -40.0]) + zero == pytest.approx([273.15, 373.15, 233.15], abs=1e-9)
    assert scale_of("C", "C", "")[1] == 0.0  # of a charge


def test_without_units_the_size_of_a_temperature_tells_its_degrees(tmp_path: Path) -> None:
    warm, pressed = rising()
    path = logged(tmp_path, "t [s],theta [rad],motor encoder,N(t) [N],Temp", warm, pressed)
    columns = {one.name: one for one in draft([path], NO_ANSWERS).logs[0].files[0].columns}
    assert (columns["Temp"].role, columns["Temp"].unit) == ("temperature", "degC")
    assert "unit" in columns["Temp"].guessed
    assert columns["N(t)"].role == "load0"


def test_the_friction_force_beside_is_no_normal_force(tmp_path: Path) -> None:
    warm, pressed = rising()
    path = logged(tmp_path, "t [s],theta [rad],motor encoder,Reibkraft [N],T [degC]", warm, pressed)
    roles = {one.name: one.role for one in draft([path], NO_ANSWERS).logs[0].files[0].columns}
    assert roles["Reibkraft"] is None and roles["T"] == "temperature"


def test_degrees_celsius_that_are_called_kelvin_are_told(tmp_path: Path) -> None:
    path = logged(tmp_path, "t [s],theta [rad],motor encoder,Fn [N],Temp [K]", *rising())
    write(draft([path], DRIVEN))
    with pytest.raises(StickslipError, match=r"'temperature' is about 25 K.*Degrees Celsius in a column of kelvin"):
        read_log(path)


@pytest.mark.parametrize("unit", ["V", "N"])
def test_what_is_no_temperature_is_told(tmp_path: Path, unit: str) -> None:
    path = logged(tmp_path, f"t [s],theta [rad],motor encoder,Fn [N],Temp [{unit}]", *rising())
    with pytest.raises(StickslipError, match=rf"Column 'Temp' \(temperature\) is in '{unit}'.*converted to K"):
        draft([path], Answers(columns={"Temp": "temperature"}, units={"Temp": unit}))
