"""What pictures say: symbols and labels of axes, motions in words, colours that grey and other eyes keep apart."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from matplotlib.mathtext import MathTextParser
from scene_file import CLASS_A, scene_of

import fmu_models.report.views  # noqa: F401  registers what it draws
from fmu_models.analyses.basins import basins
from fmu_models.analyses.diagram import orbit_diagram
from fmu_models.base import shown
from fmu_models.fmu.load import load
from fmu_models.maps.logistic import MAP as LOGISTIC
from fmu_models.report.colours import COLOURS
from fmu_models.report.words import axis_label, caption, in_words, symbol
from fmu_models.scene.read import read_scene
from fmu_models.sections.crossing import Impacts
from fmu_models.sections.iteration import Iteration
from fmu_models.sections.strobe import Strobe


@pytest.mark.parametrize(
    ("name", "formula"),
    [
        *(
            ("k0", "$k_{0}$"),
            ("ks", "$k_{s}$"),
            ("mu_s0", r"$\mu_{s0}$"),
            ("eN1", "$e_{N1}$"),
            ("c_phi", r"$c_{\phi}$"),
        ),
        *(("theta", r"$\theta$"), ("Omega", r"$\Omega$"), ("x", "$x$"), ("gap", "gap"), ("right_force", "right_force")),
        *(("max(x)", "max(x)"), ("body.x", "body.x"), ("a$b", r"a\$b")),
    ],
)
def test_symbols_are_what_matplotlib_can_set(name: str, formula: str) -> None:
    assert symbol(name) == formula
    MathTextParser("agg").parse(symbol(name))


def test_labels_say_what_a_quantity_is_with_symbol_and_unit() -> None:
    """Of a model by its declaration: the first words of the description, and no unit where that is 1."""
    units = Strobe(load("discontinuous_support"), forcing="omega").units("omega", "x", "v", "ks")
    assert axis_label("omega", units) == r"angular frequency of the force $\omega$ (rad/s)"
    assert axis_label("v", units) == "rate of $x$, $v$ (m/s)"
    assert axis_label("ks", units) == "stiffness of the support $k_{s}$ (N/m)"
    hinge = Impacts(load("hinge_clearance"), "right", forcing="f").units("f", "phase")
    assert axis_label("f", hinge) == "frequency of the force $f$" and axis_label("phase", hinge) == "phase"
    assert axis_label("r", Iteration.of(LOGISTIC).units("r")).endswith("$r$")
    assert axis_label("speed", {"speed": "m/s"}) == "speed (m/s)"


def test_words_of_motions_name_the_contacts() -> None:
    units = Impacts(load("hinge_clearance"), "right", forcing="f").units("f")
    assert in_words("1-1-2", units) == "1-1-2: right once, left twice"
    assert in_words("4-4-0 (2)", units) == "4-4-0: right 4 times (2)"
    assert in_words("1-0-0 (33.4 %)", units) == "1-0-0: without contact (33.4 %)"
    assert in_words("chaos", units) == "chaos" and in_words("3", units) == "3" and in_words("1-0", {}) == "1-0"


def test_a_basin_says_its_motions_in_words() -> None:
    parameters = {"ks": 10.0, "cs": 0.3, "g": 4.0, "omega": 1.1}
    system = Strobe(load("discontinuous_support"), forcing="omega", parameters=parameters)
    figure = Figure(layout="constrained")
    axes = figure.subplots()
    shown.draw(basins(system, x=np.linspace(-8, 8, 4), v=np.linspace(-8, 8, 4)), axes)
    legend = axes.get_legend()
    assert legend is not None
    said = [text.get_text().partition(" (")[0] for text in legend.get_texts()]
    assert said == ["1-0: without contact", "1-1: support once"]
    figure.draw_without_rendering()
    assert not legend.get_window_extent().overlaps(axes.xaxis.label.get_window_extent())


def test_constants_stand_below_and_departures_are_said(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, CLASS_A)
    assert "$N_{0}$ = 8 N" in caption(scene).replace("\n", " ") and "departs" not in caption(scene)
    lines = caption(scene).splitlines()
    assert len(lines) > 1 and all(line.endswith(";") for line in lines[:-1])  # none parts a value from its unit
    departing = read_scene(scene.path, {"N0": "9 N"})
    assert "$N_{0}$ = 9 N" in caption(departing).replace("\n", " ")
    assert caption(departing).endswith("departs: $N_{0}$ is 8 in the scene")


def test_a_diagram_is_as_dark_as_its_points_are_dense() -> None:
    """The logistic map at r = 4, whose density 1/(pi sqrt(x (1 - x))) is largest at both ends; period 1 at 2.8."""
    r = np.array([2.8, 4.0])
    found = orbit_diagram(Iteration.of(LOGISTIC), "r", r, start=[0.3], transient=500, points=4000)
    axes = Figure().subplots()
    shown.draw(found, axes)
    (drawn,) = axes.collections
    assert isinstance(drawn, PathCollection)
    place, shade = np.asarray(drawn.get_offsets()), np.asarray(drawn.get_array())
    chaos = place[:, 0] == 4.0
    assert (shade[~chaos] == 1.0).all()
    middle, ends = (np.abs(place[:, 1] - 0.5) < 0.3) & chaos, (np.abs(place[:, 1] - 0.5) > 0.49) & chaos
    assert shade[ends].mean() > shade[middle].mean() + 0.05
    assert drawn.get_sizes()[0] > 2.0 * _size(np.linspace(2.8, 4.0, 800))


def _size(r: np.ndarray) -> float:
    axes = Figure().subplots()
    shown.draw(orbit_diagram(Iteration.of(LOGISTIC), "r", r, start=[0.3], transient=10, points=4), axes)
    (drawn,) = axes.collections
    assert isinstance(drawn, PathCollection)
    return float(drawn.get_sizes()[0])


# of what eyes without one kind of cones see, in linear RGB (Machado, Oliveira, Fernandes, 2009)
EYES = (
    np.eye(3),
    [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
)
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def _lab(colour: str, eye: np.ndarray) -> np.ndarray:
    rgb = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    t = XYZ @ np.clip(eye @ linear, 0.0, 1.0) / [0.9505, 1.0, 1.089]
    x, y, z = np.where(t > 0.008856, np.cbrt(t), 7.787 * t + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def test_the_first_colours_stay_apart_in_grey_and_for_all_eyes() -> None:
    """By lightness L* alone in grey, of which 2.3 is just seen; by distance in Lab for eyes without some cones."""
    for eye in map(np.array, EYES):
        labs = [_lab(colour, eye) for colour in COLOURS[:6]]
        assert min(np.linalg.norm(a - b) for a, b in combinations(labs, 2)) > 15.0
    greys = [_lab(colour, np.eye(3))[0] for colour in COLOURS[:6]]
    assert min(abs(a - b) for a, b in combinations(greys, 2)) > 6.5
