"""The measuring chain, asked: beam, noise and delay of a laser, ratio and belt of encoders."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bench_columns import SAID, bench_log, written

from fmu_models.base.errors import StickslipError
from rig_io.description.answers import Answers
from rig_io.description.draft import draft, write
from rig_io.description.questions import optional
from rig_io.packages.datapackage import read_log


def test_what_the_laser_sees_how_late_it_is_and_where_the_encoder_sits_are_kept(described: Path) -> None:
    said = {"laser_beam": "Arc, 3 deg", "laser_latency": "butterworth 2, 50 Hz", "encoder": "1000 x4, ratio 2.5"}
    write(draft([described], replace(SAID, values={**SAID.values, **said})))
    laser, encoder = (read_log(described).calibration.need(name) for name in ("laser", "encoder"))
    assert (laser.beam, laser.tilt) == ("arc", pytest.approx(np.radians(3)))
    # 1/(s^2 + sqrt(2) s + 1) in s over the corner's circular frequency
    assert laser.latency == pytest.approx(np.sqrt(2) / (2 * np.pi * 50))
    assert encoder.pitch == pytest.approx(2 * np.pi / 10000)
    again = draft([described], Answers())
    assert again.beside["beam"] == "arc" and not [q for q in optional(again) if q.key != "laser_noise"]


@pytest.mark.parametrize(
    ("text", "creep", "deviation"),
    [("0.5 ± 0.2 %", 0.005, 0.002), ("unknown", 0.0, None), ("gear", 0.0, 0.0), ("0.01", 0.01, None)],
)
def test_a_belt_is_asked_for_where_the_encoder_sits_on_the_motor(
    described: Path, text: str, creep: float, deviation: float | None
) -> None:
    def asked(answers: Answers) -> list[str]:
        return [question.key for question in optional(draft([described], answers))]

    on_motor = replace(SAID, values={**SAID.values, "drive0": "500, ratio 3"})
    assert "belt" not in asked(SAID) and "belt" in asked(on_motor)
    write(draft([described], replace(on_motor, values={**on_motor.values, "belt": text})))
    encoder = read_log(described).calibration.need("drive0")
    assert (encoder.creep, encoder.creep_deviation) == (pytest.approx(creep), deviation and pytest.approx(deviation))
    assert encoder.pitch == pytest.approx(2 * np.pi / 1500 * (1 - creep)) and encoder.may_creep == (text != "gear")
    assert "belt" not in asked(Answers())


@pytest.mark.parametrize(
    "value",
    [
        "belt=20 %",
        "laser_beam=cosine",
        "laser_beam=arc 3 mm",
        "laser_latency=butterworth 0, 50 Hz",
        "laser_latency=2 mm",
        "encoder=1000, ratio x",
    ],
)
def test_a_measuring_chain_that_is_none_is_refused(described: Path, value: str) -> None:
    name, _, text = value.partition("=")
    said = {**SAID.values, "drive0": "500, ratio 3", name: text}
    with pytest.raises(StickslipError, match=name):
        write(draft([described], replace(SAID, values=said)))


def test_a_belt_without_a_motor_is_refused(described: Path) -> None:
    with pytest.raises(StickslipError, match="no encoder of a drive sits on the motor"):
        draft([described], replace(SAID, values={**SAID.values, "belt": "unknown"}))


def test_the_noise_of_a_laser_is_kept_for_fits(described: Path) -> None:
    """Of one that writes volts or lengths; once said it is not asked for again."""

    def noise(path: Path, said: Answers, text: str) -> float:
        beside = {"laser_noise": text, "laser_beam": "sine", "laser_latency": "0"}
        made = draft([path], replace(said, values={**said.values, **beside}))
        assert not optional(made)
        write(made)
        laser = read_log(path).calibration.laser
        assert laser is not None
        return laser.noise

    assert [one.key for one in optional(draft([described], SAID))] == ["laser_beam", "laser_noise", "laser_latency"]
    assert noise(described, SAID, "20 um") == pytest.approx(2e-5)
    assert not optional(draft([described], Answers()))
    length = replace(SAID, units={"Weg": "mm"})
    log, folder = bench_log(), described.parent / "length"
    folder.mkdir()
    path = written(folder, "Zeit [ms];Weg;Antrieb", [1e3 * log["time"], 10 * log["laser"], log["drive"]])
    assert noise(path, length, "0.03 mm") == pytest.approx(3e-5)
    assert noise(described, SAID, "unknown") == 0.0
    with pytest.raises(StickslipError, match="no laser has a noise of 0 m"):
        noise(described, SAID, "0")
