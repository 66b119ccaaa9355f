"""Rotating body that touches one or both of two driven discs, by its angle (the paper's class d).

    J theta'' + c theta' + k theta = R sum_i chi_i(theta) N_i mu_i(|v_i|) sgn(v_i),    v_i = r w_i - R theta'
    chi_0 = 1 where theta <= alpha,    chi_1 = 1 where theta >= -alpha,    0 elsewhere

Body, discs and friction are those of ``disc_rig``, which this becomes when alpha exceeds every angle (the paper's
pi/2). Stick also ends where the body leaves its disc.

Source: Casini, Giannini, Vestroni, Nonlinear Dynamics 46 (2006), section 2.1 (d) and Fig. 2d. The paper gives no
values: alpha = 0.1 rad, w0 = 0.6 rad/s and w1 = 1 rad/s are assumed.
"""

from fmu_models.language.quantities import Parameter
from fmu_models.oscillators.disc_rig import disc, rig, theta

alpha = Parameter("alpha", 0.1, "rad", "both discs are touched at angles from -alpha to alpha", minimum=0.0)

MODEL = rig(
    "disc_rig_overlapping",
    "Rotational oscillator against two driven discs that overlap",
    disc(0, speed=0.6, where=alpha - theta),
    disc(1, speed=1.0, where=theta + alpha),
)
