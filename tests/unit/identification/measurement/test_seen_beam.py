"""The beam of a laser that is described wrongly is told by the encoder beside it, and taken."""

from __future__ import annotations

from dataclasses import replace

import pytest

from identification.measurement.free_decay import fit_free_decay
from identification.measurement.pooling import motions_in_pieces, pool
from identification.measurement.seen_beam import TILT, beam_words, seen_beam
from identification.model_check.processing import measured_motions
from rig_io.bench.emulator import emulate, standard_set
from rig_io.logs.beam import BEAMS
from rig_io.logs.log import RigLog
from rig_io.sensors import Laser

WINDOW = 0.04


def logs(true: str, told: str, tilt: float = 0.0, edge_times: bool = True, lasts: float = 6.0) -> list[RigLog]:
    """A run and a free decay of a laser that sees one thing and is described to see another."""
    settings = standard_set(
        "paper/rubber", [0.83], duration=lasts, sampling_rate=500.0, laser=Laser(beam=true, tilt=tilt)
    )
    made = []
    for number, emulation in enumerate(settings):
        log = emulate(emulation, 5, number)
        laser = replace(log.calibration.need("laser"), beam=told, tilt=0.0)
        columns = {name: c for name, c in log.columns.items() if edge_times or not name.endswith("edge_time")}
        made.append(replace(log, columns=columns, calibration=replace(log.calibration, laser=laser)))
    return made


@pytest.mark.parametrize("edge_times", [True, False])
@pytest.mark.parametrize("told", BEAMS)
@pytest.mark.parametrize("true", BEAMS)
def test_a_beam_is_named_where_it_is_another(true: str, told: str, edge_times: bool) -> None:
    lasts = 6.0 if edge_times else 12.0
    raw = motions_in_pieces(logs(true, told, edge_times=edge_times, lasts=lasts)[:1])[0]
    assert seen_beam(raw, WINDOW) == (() if true == told else (true,))


def test_a_tilted_beam_is_no_other_and_a_laser_alone_tells_nothing() -> None:
    assert seen_beam(motions_in_pieces(logs("sine", "sine", 0.04)[:1])[0], WINDOW) == ()
    run = logs("arc", "sine")[0]
    alone = replace(run, columns={n: c for n, c in run.columns.items() if not n.startswith("encoder")})
    assert seen_beam(motions_in_pieces([alone])[0], WINDOW) == ()


def test_beams_that_a_log_does_not_tell_apart_are_all_named() -> None:
    """Few lines know the cube of the angle so poorly that a half more of it would do."""
    raw = motions_in_pieces(logs("arc", "tangent", edge_times=False, lasts=3.0)[:1])[0]
    beams = seen_beam(raw, WINDOW)
    assert beams[0] in ("arc", "sine") and {"arc", "sine"} <= set(beams)
    said = beam_words(raw[0].log.calibration.need("laser"), ("arc", "sine", TILT))
    assert said.endswith(
        "with laser_beam=arc; they do not tell it from laser_beam=sine or a tilt of the beam, larger swings would."
    )


def test_a_comparison_takes_the_beam_that_is_seen() -> None:
    wrong, right = (measured_motions(logs("tangent", told), 0.9)[("disc0",)] for told in ("sine", "tangent"))
    assert (wrong[0].angle == right[0].angle).all() and wrong[0].log.calibration.need("laser").beam == "tangent"


@pytest.mark.parametrize("given", [False, True])
def test_logs_are_pooled_with_the_beam_that_is_seen_and_their_decay_too(given: bool) -> None:
    wrong, right = logs("tangent", "sine"), logs("tangent", "tangent")
    said = None
    if given:
        decay = next(log for log in wrong if log.kind == "free-decay")
        said = fit_free_decay(decay).with_ratios({"c/J": 1.5}, {"c/J": 0.1})
    taken, known = pool(wrong, free_decay=said), pool(right)
    assert taken.warnings[0].startswith("Against the encoder the laser sees a flat arm")
    assert "laser_beam=tangent" in taken.warnings[0] and taken.warnings[1:] == known.warnings
    assert taken.assumed == known.assumed
    assert taken.decay is not None and known.decay is not None
    assert taken.decay.stiffness_ratio == known.decay.stiffness_ratio
    assert taken.decay.damping_ratio == (1.5 if given else known.decay.damping_ratio)
    assert (taken.motions[0].angle == known.motions[0].angle).all()
