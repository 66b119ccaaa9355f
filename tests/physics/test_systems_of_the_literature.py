"""Forty systems of the literature: each runs as its scene says, and what their scenes know is computed here anew.

Values that a scene calls "computed" are those of the functions below: other programs of the same equations, in mpmath
with 30 digits, in closed form, or by SciPy's DOP853 from event to event.
"""

from __future__ import annotations

from collections.abc import Callable

import mpmath as mp
import pytest
from some_nightly import some_nightly

from fmu_models.base import shipped
from fmu_models.fmu.fmu import Fmu
from fmu_models.scene.compute import compare, compute
from fmu_models.scene.read import read_scene
from fmu_models.scene.reduce import built_scene

DAILY = ("circle_map", "henon_attractor")
SCENES = shipped.files(shipped.LITERATURE)


def eigenvalues(jacobian) -> list[float]:
    """Largest modulus first."""
    return sorted(mp.eig(mp.matrix(jacobian), left=False, right=False), key=lambda z: -abs(z))


def ikeda() -> dict[str, float]:
    """The map in complex numbers."""

    def step(x, y):
        z = mp.mpc(x, y)
        z = 1 + mp.mpf("0.9") * z * mp.exp(1j * (mp.mpf("0.4") - 6 / (1 + abs(z) ** 2)))
        return z.real, z.imag

    point = mp.findroot(lambda x, y: [a - b for a, b in zip(step(x, y), (x, y), strict=True)], (0.53, 0.25))
    slopes = [[mp.diff(lambda *p, i=i: step(*p)[i], tuple(point), by) for by in ((1, 0), (0, 1))] for i in (0, 1)]
    return {"x": point[0], "y": point[1], "multiplier1_real": eigenvalues(slopes)[0].real}


def nordmark() -> dict[str, float]:
    """Two free steps, one impact: root of one equation for the depth x of the impact."""
    alpha, gamma, tau2, rho = map(mp.mpf, ("0.65", "0.05", "0.9", "0.12"))

    def after(x, y):
        x, y = -mp.sqrt(x) + y + rho, -gamma * tau2 * x
        for _ in range(2):
            x, y = alpha * x + y + rho, -gamma * x
        return x, y

    depth, second = mp.findroot(lambda x, y: [after(x, y)[0] - x, after(x, y)[1] - y], (0.114, 0.001))
    free = mp.matrix([[alpha, 1], [-gamma, 0]])
    slopes = free * free * mp.matrix([[-1 / (2 * mp.sqrt(depth)), 1], [-gamma * tau2, 0]])
    return {"x_min": -mp.sqrt(depth) + second + rho, "x_max": depth, "multiplier1_real": eigenvalues(slopes)[0].real}


def tinkerbell() -> dict[str, float]:
    a, b, c, d = map(mp.mpf, ("0.9", "-0.6013", "2", "0.5"))
    x, y = mp.findroot(
        lambda x, y: [x * x - y * y + (a - 1) * x + b * y, 2 * x * y + c * x + (d - 1) * y], (1.03, -1.32)
    )
    largest = eigenvalues([[2 * x + a, b - 2 * y], [2 * y + c, 2 * x + d]])[0]
    return {"x": x, "y": y, "multiplier1_real": largest.real}


COMPUTED: dict[str, Callable[[], dict[str, float]]] = {"ikeda": ikeda, "nordmark": nordmark, "tinkerbell": tinkerbell}


@pytest.mark.parametrize("path", some_nightly(SCENES, [p for p in SCENES if p.stem in DAILY]), ids=lambda p: p.stem)
def test_a_scene_meets_what_is_known(path):
    scene = read_scene(path)
    comparisons = compare(scene, compute(scene, Fmu.open(built_scene(scene))))
    assert len({(c.name, c.at) for c in comparisons}) >= 2
    for comparison in comparisons:
        assert comparison.passed, comparison


@pytest.mark.parametrize("name", COMPUTED)
def test_computed_values_are_those_of_another_program(name):
    with mp.workdps(30):
        values = COMPUTED[name]()
    (known,) = [r for r in read_scene(name).references if r.source.startswith("computed")]
    assert known.values == pytest.approx({n: float(value) for n, value in values.items()}, rel=known.tolerance)


def test_each_system_is_short_and_says_where_it_comes_from():
    for path in SCENES:
        scene = read_scene(path)
        assert scene.source and all(reference.source for reference in scene.references), path.stem
    for path in shipped.files(shipped.LITERATURE, ".py"):
        docstring, code = path.read_text("utf-8").rsplit('"""\n', 1)
        assert "Source: " in docstring, path.stem
        lines = [line for line in code.splitlines() if line and not line.startswith(("import", "from"))]
        assert len(lines) <= 20, (path.stem, len(lines))
        assert (path.with_suffix(".toml")) in SCENES
