"""Loops over what has one shape: same bits as statements one by one, text that hardly grows with the bodies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy
from quick_export import quick_export

from fmu_models import Conti, Friction, KelvinVoigt, Mechanism, Parameter, SensitiveRun, Stop, simulate
from fmu_models.codegen import c_function, loops
from fmu_models.codegen.c_source import sources
from fmu_models.fmu.fmu import Fmu
from fmu_models.language.quantities import Coordinate
from fmu_models.lowering.lower import lower


def chain(n: int) -> Mechanism:
    """Masses of their own between hardening springs; each rubs, every second one has a stop before it."""
    q = [Coordinate(f"q{i}", "m", f"place {i}", velocity=f"v{i}", start=0.1 * np.sin(1.0 + i)) for i in range(n)]
    m, k, c = (Parameter(name, 1.0, unit, name) for name, unit in (("m", "kg"), ("k", "N/m"), ("c", "N s/m")))
    hard, N = Parameter("h", 4.0, "N/m3", "hardening"), Parameter("N", 0.02, "N", "load")
    one, half, p = (Parameter(name, 1.0, unit, name) for name, unit in (("mu_s", "1"), ("mu_k", "1"), ("p", "s/m")))
    gap = Parameter("g", 0.05, "m", "gap")
    way = [b - a for a, b in zip([0, *q], q, strict=False)]
    frictions = [Friction(name=f"f{i}", slip=x.v, law=Conti(N, one, half, p)) for i, x in enumerate(q)]
    stops = [
        Stop(name=f"s{i}", gap=gap * sympy.Float(1 + 0.2 * i) - x, law=KelvinVoigt(10 * k, c), release="gap")
        for i, x in enumerate(q[::2])
    ]
    return Mechanism(
        name=f"chain{n}",
        title="chain",
        source="test",
        coordinates=q,
        kinetic_energy=sympy.Add(*(m * sympy.Float(1 + 0.1 * (i % 3)) * x.v**2 / 2 for i, x in enumerate(q))),
        potential_energy=sympy.Add(*(k * w**2 / 2 + hard * w**4 / 4 for w in way)),
        dissipation=sympy.Add(*(c * x.v**2 / 20 for x in q)),
        contacts=[*frictions, *stops],
    )


def bits(path: Path) -> list[bytes]:
    """Of all states at the end of a run through events, and of their derivatives."""
    fmu = Fmu.open(path)
    run = simulate(fmu, 1.5)
    assert {e.contact[0] for e in run.events} == {"f", "s"}
    with SensitiveRun(fmu, by=("m", "N", "q3")) as sensitive:
        derived = sensitive.run(np.array([0.0, 0.7, 1.5]))
    return [*(run[name].tobytes() for name in ("q3", "v7", "energy", "f5_force")), derived.derivative.tobytes()]


def test_loops_have_the_bits_of_single_statements(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    declared = chain(34)
    in_loops = quick_export(declared, tmp_path / "loops.fmu")
    assert " of[n][" in sources(lower(declared))["model_kind.c"]
    for module in (loops, c_function):
        monkeypatch.setattr(module, "ALIKE", 10**6)
    one_by_one = quick_export(declared, tmp_path / "single.fmu")
    assert bits(in_loops) == bits(one_by_one)


def test_statements_do_not_become_more_with_the_bodies() -> None:
    small, large = (sources(lower(chain(n))) for n in (34, 51))
    for name in ("model_kind.c", "model_variation.c"):
        counts = [text[name].count("k] = ") + text[name].count("k] += ") for text in (small, large)]
        assert counts[0] == counts[1]


def test_a_statement_waits_for_what_it_reads() -> None:
    lines = [
        line for i in range(20) for line in (f"j->w[{i}][k] = j->x[{i}][k];", f"j->y[{i}][k] = 2.0 * j->w[{i}][k];")
    ]
    first, second = loops.rolled(lines)
    assert "j->w[at[n][0]][k] = j->x[at[n][0]][k];" in first
    assert "j->y[at[n][0]][k] = 2.0 * j->w[at[n][0]][k];" in second
    # each reads what the one before has set, or all are set anew between
    follow = [f"j->w[{i + 1}][k] = jet_square(j->w[{i}], k);" for i in range(20)]
    assert loops.rolled(follow) == follow
    barred = [*lines[::2], "mass_solve(j->w);", *lines[1::2]]
    assert [line.startswith("mass_solve") for line in loops.rolled(barred)] == [False, True, False]


def test_a_long_sum_keeps_its_order() -> None:
    terms = " ".join(f"{'-' if i > 11 else '+'} (d[{i}] + 1.5) * j->x[{i}][k]" for i in range(1, 40))
    (text,) = loops.rolled([f"j->y[0][k] = -(a + b) * j->t[k] {terms};"])
    assert text.startswith("j->y[0][k] = -(a + b) * j->t[k]; j->y[0][k] += (d[1] + 1.5) * j->x[1][k];")
    assert text.endswith("j->y[0][k] -= (d[at[n][0]] + 1.5) * j->x[at[n][0]][k]; } }")
