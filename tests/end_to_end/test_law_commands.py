"""Which law, how sure, which experiment next; fits that warn where the model is wrong and are silent elsewhere."""

from __future__ import annotations

import inspect
import io
import json
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from benchmark_scripts import benchmark_script
from rich.console import Console
from some_nightly import some_nightly

from identification.commands.fit import fit as fit_command
from identification.commands.laws import print_laws
from identification.fit.fit import fit_friction
from identification.fit.result import FrictionFit
from identification.fitted_model.model import fitted_model
from identification.laws import find_law, slip_laws
from identification.measurement.pooling import pool
from identification.next_step.laws import compare_contacts, compare_laws
from rig_io.bench.emulation import MicroSlip
from rig_io.bench.emulator import emulate, standard_set
from rig_io.logs.log import RigLog
from rig_io.packages.datapackage import read_package

ROOT = Path(__file__).parents[2]
RIGS = ROOT / "data" / "rigs" / "paper_rubber"


@pytest.fixture(scope="module")
def logs() -> list[RigLog]:
    return read_package(RIGS)


@pytest.fixture(scope="module")
def benchmark() -> ModuleType:
    return benchmark_script("bench_law_comparison")


@pytest.mark.nightly
def test_fit_laws_and_design_in_a_row(stickslip, tmp_path):
    asked = ("--estimator", "weak-form", "--covariance", "hac", "--profile", "--result", "fit.json", "--json")
    fitted = stickslip("fit", RIGS, *asked).json
    assert fitted["covariance"] == "hac" and [one["kind"] for one in fitted["intervals"]] == ["profile"] * 3
    for one, parameter in zip(fitted["intervals"], fitted["parameters"], strict=True):
        assert one["low"] < parameter["value"] < one["high"]
    two = [RIGS / f"paper-rubber-{speed}.csv" for speed in ("0.41", "1.4")]
    compared = stickslip("laws", *two, "--json").json
    assert [one["law"] for one in compared["scores"]][:2] == ["Conti", "Conti+viscous"]
    assert compared["estimator"] == "shooting" and compared["causes"] == [] and "Coulomb" in compared["aside"]
    assert compared["warnings"] == [] and "Likely: what Conti+viscous has more" in compared["verdict"]
    planned = stickslip("design", "fit.json", "--speeds", "0.2,3.5", "--loads", "4.905", "--json").json
    assert planned["candidates"][-1]["refused"] == "slides without sticking"
    shown = " ".join(stickslip("design", "fit.json", "--speeds", "0.2,3.5").out.split())
    assert "would help most" in shown and "Refused (slides without sticking): 3.5 rad/s" in shown
    plan = stickslip("design", "fit.json", "--logs", "2", "--json").json["plan"]
    assert len(plan["logs"]) == 2 and plan["logs"][1]["deviations"]["p"] < plan["repeated"]["p"]
    assert "Plan of 2 logs of 20 s" in stickslip("design", "fit.json", "--logs", "2").out
    assert "plans 1 to 50 logs" in stickslip("design", "fit.json", "--logs", "0").err


@pytest.mark.nightly
def test_command_and_python_give_the_same_fit_to_the_last_digit(stickslip, tmp_path, logs):
    from_shell = stickslip("fit", RIGS, "--estimator", "weak-form", "--json").json
    plain = json.loads(fit_friction(logs, estimator="weak-form").to_json())
    assert plain["rivals"]
    for key in set(plain) - {"recorded"}:
        assert from_shell[key] == plain[key], key


def test_defaults_are_those_of_python():
    ours = {name: one.default for name, one in inspect.signature(fit_friction).parameters.items()}
    command = {name: one.default for name, one in inspect.signature(fit_command).parameters.items()}
    for name in ("estimator", "law", "disturbances", "law_spread"):
        assert command[name] == ours[name], name
    asked = ours["inference"]
    assert (command["covariance"], command["bootstrap"], command["seed"]) == (asked.covariance, asked.draws, asked.seed)
    assert (ours["disturbances"], ours["law_spread"]) == ("auto", "auto")


def test_bad_options_are_answered_in_words(stickslip, tmp_path):
    assert "Did you mean 'jackknife'" in stickslip("fit", RIGS, "--covariance", "jacknife").err
    Path("fit.json").write_text(json.dumps({"type": "something"}))
    assert "not a fitted law" in stickslip("design", "fit.json").err
    answer = stickslip("design", "fit.json", "--speeds", "fast")
    assert answer.code == 2
    assert "not a fitted law" in answer.err or "numbers with commas" in answer.err
    assert "no friction law 'conty'" in stickslip("fit", RIGS, "--law", "conty", "--estimator", "weak-form").err


@pytest.mark.parametrize("name", some_nightly(slip_laws(), ("Conti", "Dieterich")))
def test_every_law_is_fitted_written_read_and_simulated(name: str, logs: list[RigLog]) -> None:
    fit = fit_friction(pool(logs), estimator="weak-form", law=name)
    again = FrictionFit.from_json(fit.to_json())
    assert again == fit and again.law == name
    motion = fitted_model(again).run({"disc0": 0.41}, 5.0, 1e-3)
    r, R, J = (fit.constant(one).value for one in ("r", "R", "J"))
    slip = r * 0.41 - R * motion.speed
    if name in ("Conti", "Conti+viscous", "Tustin"):
        # it sticks and slips, and the spring is released at the friction at rest of this law
        assert np.mean(np.abs(slip) < 1e-9) > 0.1
        at_rest = float(find_law(name).value(np.zeros(1), fit.law_values)[0])
        held = motion.angle[np.abs(slip) < 1e-9]
        reached = (at_rest * 4.905 * R - fit.constant("c/J").value * J * r * 0.41 / R) / (fit.constant("k/J").value * J)
        assert np.max(held) == pytest.approx(reached, abs=2e-4)
    elif name == "Dieterich":
        # it is the age of contacts at release that sets the cycle
        assert 0.1 < np.ptp(motion.angle) < 0.3
    elif name == "Stribeck+viscous":
        # its fall begins with no slope: the disc comes near to rest where the spring balances it
        friction = float(find_law(name).value(np.array([r * 0.41]), fit.law_values)[0])
        balance = friction * 4.905 * R / (fit.constant("k/J").value * J)
        assert np.mean(motion.angle) == pytest.approx(balance, rel=0.01)
    else:
        # friction that does not fall drives no cycle: the disc rests where the spring balances it
        assert np.ptp(motion.angle) < 1e-3


@pytest.mark.nightly
def test_models_that_are_wrong_say_so_and_right_ones_do_not(benchmark: ModuleType) -> None:
    cases = {case.name: case for case in benchmark.CASES}
    right = benchmark.one(3, cases["paper/rubber"], "weak-form")
    assert not any(right.values())
    elastic = benchmark.one(3, cases["paper/rubber, micro-slip 5e4"], "weak-form")
    # within their uncertainties the constants of the rig take up what micro-slip does to the course
    assert elastic["pre-sliding"] and not elastic["speeds"]
    ready = pool(benchmark.logs(cases["paper/rubber, exponential"], 3))
    other = benchmark.flagged(fit_friction(ready, estimator="weak-form"))
    assert other["speeds"] and other["course"] and not other["pre-sliding"]
    compared = compare_laws(ready, ("Coulomb", "Conti", "Tustin"), estimator="weak-form")
    assert compared.best.law == "Tustin" and compared.verdict.endswith("Sure.") and compared.warnings == ()
    values = compared.best.values
    assert (values["mu_s"], values["mu_k"], values["v_s"]) == pytest.approx((0.65, 0.35, 0.04), rel=0.01)
    console = Console(width=200, record=True, file=io.StringIO())
    print_laws(compared, console)
    text = console.export_text()
    assert "independent ones" in text and "held out" in text and "Tustin before Conti" in text


@pytest.mark.digits
def test_the_default_fit_gives_the_truth_back_near_the_bound(logs: list[RigLog]) -> None:
    fit = fit_friction(logs)
    for parameter, value in zip(fit.parameters, (0.65, 0.35, 15.0), strict=True):
        low, high = fit.interval(parameter.name, 0.999)
        assert low < value < high
        assert parameter.efficiency is not None and parameter.efficiency > 0.6
    assert fit.collinearity is not None and 4 < fit.collinearity.index < 8
    assert fit.warnings == ()


@pytest.mark.nightly_for("50000.0")
@pytest.mark.parametrize("stiffness", [0.0, 5e4])
def test_bristles_come_first_where_they_are_and_only_there(stiffness: float) -> None:
    micro = MicroSlip(stiffness) if stiffness else None
    settings = standard_set("paper/rubber", (0.41, 0.83), micro_slip=micro, duration=4.0)[:2]
    found = compare_contacts(pool([emulate(one, 2, number) for number, one in enumerate(settings)]))
    if not stiffness:
        assert [one.law for one in found.scores] == ["Conti, rigid"] and "no micro-slip" in found.verdict
        return
    assert [one.law for one in found.scores] == ["LuGre", "Conti, rigid"]
    assert found.verdict.endswith("Sure.") and found.best.values["sigma0"] == pytest.approx(5e4, rel=0.05)
