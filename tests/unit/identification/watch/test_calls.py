"""What a watch calls: a parameter that leaves its limits, a sensor that has gone, a drive that slips."""

from __future__ import annotations

from identification.watch.logs import RATIO, called
from identification.watch.state import FITTED, REFUSED, Entry, WatchState


def entry(number: int, mu: float = 0.6, ratio: float = 1.0, silent: tuple[str, ...] = ()) -> Entry:
    values = {"mu_s": (mu, 0.01), RATIO: (ratio, 0.002)}
    return Entry(f"run{number}.csv", {}, f"{number}", 60.0 * number, FITTED, "", values, silent)


def refused(reason: str, silent: tuple[str, ...] = ()) -> Entry:
    return Entry("run4.csv", {}, "4", 240.0, REFUSED, reason, silent=silent)


USUAL = WatchState("Conti", "shooting", tuple(entry(number) for number in range(4)))


def test_a_log_like_those_before_calls_nothing() -> None:
    assert called(USUAL, entry(4)) == ()
    assert called(WatchState("Conti", "shooting"), entry(0, ratio=0.5)) == ()  # the first says what is usual


def test_a_drive_that_slips_is_called_with_how_much() -> None:
    assert called(USUAL, entry(4, ratio=0.985)) == called(USUAL, entry(4, ratio=1.05)) == ()
    assert called(USUAL, entry(4, ratio=0.95)) == ("the drive slips: in stick the disc turns 5.0 % slower than it did",)


def test_a_parameter_that_leaves_its_limits_is_called_with_its_change() -> None:
    # the EWMA takes a fifth of a change: 0.02, where 3 standard deviations of it are 0.0095
    assert called(USUAL, entry(4, mu=0.7)) == ("wear: mu_s has moved by +0.02 from 0.6",)


def test_a_sensor_that_showed_something_and_shows_nothing_is_lost() -> None:
    assert called(USUAL, entry(4, silent=("laser",))) == ("lost sensor: 'laser' shows nothing",)
    assert called(USUAL, refused("no angle", ("laser",))) == ("lost sensor: 'laser' shows nothing",)
    assert called(USUAL, refused("it lacks 'laser'")) == ("lost sensor: it lacks 'laser'",)
    assert called(USUAL, refused("the disc hardly moved")) == ()
    # one that never showed anything is not lost, and the first log cannot tell
    quiet = WatchState("Conti", "shooting", tuple(entry(number, silent=("laser",)) for number in range(4)))
    assert called(quiet, entry(4, silent=("laser",))) == ()
    assert called(WatchState("Conti", "shooting"), refused("it lacks 'laser'", ("laser",))) == ()
