"""The systems of the literature: each runs as its scene says, and what their scenes know is computed here anew.

Values that a scene calls "computed" are those of the functions of `unforced_systems` and `forced_systems`: other
programs of the same equations, in mpmath with 30 digits, in closed form, or by SciPy's DOP853 from event to event.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from typing import Any

import mpmath as mp
import pytest
from forced_systems import FORCED
from some_nightly import some_nightly
from unforced_systems import UNFORCED, brake

from fmu_models import Strobe, branch
from fmu_models.base import shipped
from fmu_models.fmu.fmu import Fmu
from fmu_models.maps import MAPS
from fmu_models.oscillators import MODELS
from fmu_models.scene.compute import compare, compute
from fmu_models.scene.read import read_scene
from fmu_models.scene.reduce import built_scene

DAILY = ("circle_map", "henon_attractor", "buck_converter", "disc_brake")
SCENES = shipped.files(shipped.LITERATURE)
COMPUTED: dict[str, Callable[..., dict[str, Any]]] = {function.__name__: function for function in (*UNFORCED, *FORCED)}


@pytest.mark.nightly
def test_a_brake_squeals_below_the_threshold_of_its_rest():
    """Stick-slip and steady sliding are both stable between the fold of the cycles and the Hopf point."""
    system = Strobe(
        Fmu.open(built_scene(read_scene("disc_brake_squeal"))), period=1.459, autonomous=True, parameters={"mu": 0.6}
    )
    cycles = branch(system, "mu", (0.3, 0.9), start={"x": 0.03}, settle=True)
    folds = [special.value for special in cycles.special if special.kind == "fold"]
    with mp.workdps(20):

        def friction(stuck):
            return mp.findroot(lambda y, vy, slip, mu: brake(mu)[2](y, vy, slip, stuck), (0.046, 0.02, 1.12, 0.406))[3]

        longest = mp.findroot(lambda stuck: mp.diff(friction, stuck, h=1e-5), (0.29, 0.31), tol=1e-6)
        assert min(folds) == pytest.approx(float(friction(longest)), abs=1e-8)
    assert max(folds) < 0.4774 and cycles.stable[-1]


@pytest.mark.parametrize("path", some_nightly(SCENES, [p for p in SCENES if p.stem in DAILY]), ids=lambda p: p.stem)
def test_a_scene_meets_what_is_known(path):
    scene = read_scene(path)
    comparisons = compare(scene, compute(scene, Fmu.open(built_scene(scene))))
    assert len({(c.name, c.at) for c in comparisons}) >= 2
    for comparison in comparisons:
        assert comparison.passed, comparison


@pytest.mark.parametrize("name", COMPUTED)
def test_computed_values_are_those_of_another_program(name):
    scene, function = read_scene(name), COMPUTED[name]
    for known in (reference for reference in scene.references if reference.source.startswith("computed")):
        varied = {str(scene.compute.over): known.at} if signature(function).parameters else {}
        with mp.workdps(30):
            values = function(**varied)
        assert known.values == pytest.approx({n: float(value) for n, value in values.items()}, rel=known.tolerance)


def test_all_that_is_called_computed_is_computed_here():
    computed = [path.stem for path in SCENES if "computed" in path.read_text("utf-8")]
    assert sorted(COMPUTED) == computed
    assert len(SCENES) == 45 and not {path.stem for path in SCENES} & {*MODELS.names(), *MAPS.names()}


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
