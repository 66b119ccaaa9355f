"""The result of a fit: written and read back, intervals, tables and figures."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_fit import made_fit

from fmu_models.base.errors import StickslipError
from fmu_models.base.figures import save_figure
from fmu_models.base.plain_values import LARGEST
from identification.estimators.savitzky_golay import FrictionSamples
from identification.fit.parts import Constant, FittedParameter, LogSummary, SpeedBin
from identification.fit.result import FrictionFit
from identification.inference.identifiability import Collinearity
from identification.inference.profile import Interval
from identification.inference.whiteness import LogResiduals, SpeedResidual, Whiteness
from identification.laws import find_law
from identification.measurement.presliding import PreSliding
from identification.report.friction_figure import friction_figure

CONTI = find_law("Conti")
TRUTH = np.array([0.65, 0.35, 15.0])


def result() -> FrictionFit:
    parameters = tuple(
        FittedParameter(spec.name, value, spec.unit, 0.01 * value, 0.005 * value, 0.02 * value, 0.0, 1e4, False)
        for spec, value in zip(CONTI.parameters, TRUTH.tolist(), strict=True)
    )
    return FrictionFit(
        estimator="weak-form",
        law="Conti",
        structure=("rigid contact",),
        contacts=("disc0",),
        materials=("paper/rubber",),
        parameters=parameters,
        correlation=((1.0, 0.5, 0.4), (0.5, 1.0, 0.3), (0.4, 0.3, 1.0)),
        constants=(Constant("J", 0.0548, "kg*m^2", 3e-4, "log", {"mu_s": 1.0, "mu_k": 1.0, "p": None}),),
        logs=(LogSummary("slow", (0.41,), 20, 0.02, 0.1, 20.0), LogSummary("fast", (0.83,), 21, 0.02, 0.2, 20.0)),
        bins=(SpeedBin(0.05, 0.52, 0.001, 0.521, 40), SpeedBin(0.1, 0.47, None, 0.47, 3)),
        sensors={
            "laser_gain_correction": 0.001,
            "laser_gain_correction_sd": 2e-4,
            "laser_delay": 0.0,
            "laser_delay_sd": 1e-6,
        },
        segments=41,
        values=800,
        rms_residual=7e-4,
        autocorrelation=0.1,
        converged=True,
        message="ok",
        warnings=("one",),
        covariance="bootstrap",
        intervals=(Interval("mu_s", 0.95, 0.64, 0.66, "profile"), Interval("p", 0.95, 13.0, None, "profile")),
        collinearity=Collinearity(47.0, {"p": 0.15, "mu_s": 0.001}, {"p": 1.0, "mu_s": 0.16}),
        whiteness=Whiteness(
            (LogResiduals("slow", 400, 0.1, 0.2, 0.3), LogResiduals("fast", 400, 0.4, 1e-9, None)),
            (SpeedResidual(0.05, 0.1, 0.7), SpeedResidual(0.1, -0.3, -4.2)),
        ),
        presliding=PreSliding(2e-5, 5e-7, 1e-6, 40),
    )


def samples() -> FrictionSamples:
    slip = np.linspace(0.02, 0.2, 60)
    log = np.repeat([0, 1], 30)
    return FrictionSamples(slip, CONTI.value(slip, TRUTH) + 0.01 * np.sin(40 * slip), log, log, np.ones(60))


def test_json_gives_the_result_back() -> None:
    assert FrictionFit.from_json(result().to_json()) == result()
    json.loads(result().to_json(), parse_constant=pytest.fail)


FINITE = st.floats(allow_nan=False, allow_infinity=False)
POSITIVE = st.floats(1e-12, 1e12)
NAMES = st.text(max_size=8)
COUNTS = st.integers(0, LARGEST)
CHANGES = st.dictionaries(NAMES, FINITE, max_size=3)


@settings(max_examples=30, deadline=None)
@given(
    intervals=st.lists(
        st.builds(Interval, NAMES, st.floats(0.5, 0.99), st.none() | FINITE, st.none() | FINITE, NAMES), max_size=3
    ),
    collinearity=st.none() | st.builds(Collinearity, POSITIVE, CHANGES, CHANGES),
    whiteness=st.none()
    | st.builds(
        Whiteness,
        st.lists(st.builds(LogResiduals, NAMES, COUNTS, FINITE, FINITE, st.none() | FINITE), max_size=3).map(tuple),
        st.lists(st.builds(SpeedResidual, FINITE, FINITE, FINITE), max_size=3).map(tuple),
    ),
    presliding=st.none() | st.builds(PreSliding, FINITE, POSITIVE, POSITIVE, st.integers(0, 99)),
    bound=st.none() | POSITIVE,
)
def test_whatever_is_known_of_a_fit_comes_back(
    intervals: list[Interval],
    collinearity: Collinearity | None,
    whiteness: Whiteness | None,
    presliding: PreSliding | None,
    bound: float | None,
) -> None:
    made = replace(
        result(),
        intervals=tuple(intervals),
        collinearity=collinearity,
        whiteness=whiteness,
        presliding=presliding,
        parameters=tuple(replace(q, bound=bound) for q in result().parameters),
    )
    assert FrictionFit.from_json(made.to_json()) == made


def test_efficiency_is_the_bound_against_the_stated() -> None:
    q = result()["mu_s"]
    assert q.efficiency is None
    assert replace(q, bound=0.5 * q.standard_deviation).efficiency == pytest.approx(0.25)
    assert replace(q, bound=2 * q.standard_deviation).efficiency == 1
    assert replace(q, bound=1.0, standard_deviation=0.0).efficiency is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "not JSON"),
        ("[1]", "not a fitted law"),
        ('{"type": "something else"}', "not a fitted law"),
        ('{"type": "stickslip friction fit", "version": 9}', "version 9"),
        ('{"type": "stickslip friction fit", "version": 5}', "incomplete: 'estimator' is missing"),
        ("[" * 5000, "not JSON"),
    ],
)
def test_what_is_no_result_is_refused(text: str, said: str) -> None:
    with pytest.raises(StickslipError, match=said):
        FrictionFit.from_json(text)


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        (("parameters", 0, "value"), "0.5", r"parameters\[0\]\.value must be a number, found '0\.5'"),
        (("parameters", 0, "value"), 10**400, r"parameters\[0\]\.value must be a number of a size"),
        (("parameters", 0, "at_bound"), 1, "at_bound must be true or false, found 1"),
        (("parameters", 0), [], r"parameters\[0\] must be an object"),
        (("materials", 0), None, r"materials\[0\] must be a text, found None"),
        (("materials",), ["a", "b"], "contacts and materials of different number"),
        (("correlation",), [[1.0]], "no correlation of 3 by 3"),
        (("segments",), 1.5, "segments must be a whole number"),
        (("segments",), 10**400, "segments must be a whole number of a size that counts can have"),
        (("constants", 0, "sensitivity"), [], "sensitivity must be an object"),
        (("surprise",), 1, "unknown entry 'surprise'"),
    ],
)
def test_what_holds_another_type_is_refused(place: tuple[str | int, ...], value: object, said: str) -> None:
    plain = json.loads(made_fit().to_json())
    *path, last = place
    inner = plain
    for key in path:
        inner = inner[key]
    inner[last] = value
    with pytest.raises(StickslipError, match=said):
        FrictionFit.from_json(json.dumps(plain))


def test_intervals_are_student_intervals() -> None:
    fit = result()
    low, high = fit.noise_interval("mu_k")
    # 2.0244: Student's t, 38 degrees of freedom, 97.5 % (printed tables)
    assert (high - low) / 2 == pytest.approx(2.0244 * 0.0035, rel=1e-4)
    low, high = fit.interval("mu_k")
    assert (high - low) / 2 == pytest.approx(2.0244 * 0.35 * np.hypot(0.01, 0.02), rel=1e-4)


def test_intervals_take_their_noise_from_a_profile() -> None:
    low, high = result().interval("p")
    assert (low, high) == (pytest.approx(15 - np.hypot(2.0, 2.0244 * 0.02 * 15), rel=1e-4), np.inf)


def test_a_constant_without_uncertainty_makes_every_interval_say_at_least() -> None:
    from rich.console import Console

    from identification.report.fit_summary import fit_summary

    def shown(fit: FrictionFit) -> dict[str, str]:
        console = Console(width=200, file=io.StringIO())
        console.print(fit_summary(fit))
        title = friction_figure(fit, {"disc0": samples()}).axes[0].get_title()
        return {"terminal": console.file.getvalue(), "figure": title, "repr": repr(fit)}  # type: ignore[attr-defined]

    (one,) = result().constants
    open_ended = replace(result(), constants=(replace(one, standard_uncertainty=0.0, stated=False),))
    assert all("at least" in text for text in shown(open_ended).values())
    assert not any("at least" in text for text in shown(result()).values())
    # p does not feel J
    assert [open_ended.at_least(name) for name in ("mu_s", "mu_k", "p")] == [True, True, False]
    plain = open_ended.to_dict()["parameters"]
    assert list(plain[0])[:6] == ["name", "value", "unit", "low", "high", "at_least"]
    assert [one["at_least"] for one in plain] == [True, True, False] and plain[2]["high"] is None
    assert (plain[1]["low"], plain[1]["high"]) == open_ended.interval("mu_k")


def test_an_unknown_parameter_is_answered_by_the_nearest() -> None:
    with pytest.raises(StickslipError, match="mu_s"):
        result()["mu_S"]


def test_friction_figure_is_readable_without_colour() -> None:
    figure = friction_figure(result(), {"disc0": samples()})
    above, below = figure.axes
    assert "(1)" in above.get_ylabel() and "(1)" in below.get_ylabel() and "(m/s)" in below.get_xlabel()
    dots = [line for line in above.lines if line.get_linestyle() == "None"]
    assert len({str(line.get_marker()) for line in dots}) == len(dots) == 2
    law = next(line for line in above.lines if line.get_linestyle() == "-")
    x, y = np.asarray(law.get_xdata(), float), np.asarray(law.get_ydata(), float)
    np.testing.assert_allclose(y, CONTI.value(x, TRUTH))
    # residuals are what was measured less the law
    shown = np.asarray(below.lines[0].get_ydata(), float)
    np.testing.assert_allclose(shown, 0.01 * np.sin(40 * samples().slip[:30]), atol=1e-12)


def test_figures_are_written_whole(tmp_path: Path) -> None:
    target = save_figure(friction_figure(result(), {"disc0": samples()}), tmp_path / "p.svg")
    assert target.read_text().rstrip().endswith("</svg>")
    with pytest.raises(StickslipError, match="exists"):
        save_figure(friction_figure(result(), {"disc0": samples()}), target)
    with pytest.raises(StickslipError, match="no known format"):
        save_figure(friction_figure(result(), {"disc0": samples()}), tmp_path / "p.xyz")
    assert [path.name for path in tmp_path.iterdir()] == ["p.svg"]


def test_tables_show_what_is_known_of_a_fit() -> None:
    from rich.console import Console

    from identification.report.fit_summary import fit_summary

    def shown(fit: FrictionFit) -> str:
        console = Console(width=200, record=True, file=io.StringIO())
        console.print(fit_summary(fit))
        return " ".join(console.export_text().split())

    text = shown(replace(result(), parameters=tuple(replace(q, bound=0.008 * q.value) for q in result().parameters)))
    for said in (
        "95 %, profile",
        "13.00 .. open",
        "efficiency",
        "64%",
        "Collinearity index 47 (nearly collinear): p up 1 % with mu_s up 0.16 %",
        "coloured in fast (the deviations allow for it)",
        "beyond 3.5 standard errors in 1 of 2 ranges",
        "bootstrap)",
    ):
        assert said in text, said
    assert "efficiency" not in shown(result()) and "as good as rigid" not in text
    stiff = shown(replace(result(), presliding=PreSliding(1e-7, 5e-7, 1e-6, 40)))
    assert "its stiffness is above 4e+05 N/m" in stiff


def test_tables_show_values_and_warnings() -> None:
    from rich.console import Console

    from identification.report.fit_summary import fit_summary

    console = Console(width=160, record=True, file=io.StringIO())
    console.print(fit_summary(result()))
    text = console.export_text()
    for shown in ("mu_s", "0.65", "s/m", "rigid contact", "Warning: one"):
        assert shown in text
