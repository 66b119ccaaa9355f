"""Planar system whose eigenvalues cross the imaginary axis twice at once: multiple crossing bifurcation.

    x1' = x1 + 2 |x1| + x2
    x2' = x1 + 2 |x1| + x2/2 + mu

Its flow is continuous and has a kink at x1 = 0. For mu < 0 there are a saddle (-2/3 mu, 2 mu) and a stable focus
(2 mu, 2 mu); they meet at mu = 0 and there is no equilibrium for mu > 0. ``planar_multiple_crossing_smooth`` shows
what happens in between. Most motions grow without bound; the one from the default start approaches the focus.

Source: Leine and van Campen, Bifurcation phenomena in non-smooth dynamical systems, European Journal of Mechanics
A/Solids 25 (2006), equations (8) to (13); Fig. 4 has mu = -1, 0 and 1.
"""

from fmu_models import Automaton, Parameter, State, Switch

mu = Parameter("mu", -1.0, "1", "bifurcation parameter")
x1 = State("x1", "1", "first state", start=0.2)
x2 = State("x2", "1", "second state", start=-3.0)
kink = Switch(name="kink", function=x1, description="kink of the flow at x1 = 0")

MODEL = Automaton(
    name="planar_multiple_crossing",
    title="Planar system with a multiple crossing bifurcation",
    source="Leine and van Campen, European Journal of Mechanics A/Solids 25 (2006), equation (8)",
    states=[x1, x2],
    flows={x1: x1 + 2 * kink.abs + x2, x2: x1 + 2 * kink.abs + x2 / 2 + mu},
    switches=[kink],
)
