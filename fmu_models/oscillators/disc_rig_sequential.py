"""Rotating body that touches one of two driven discs at a time, by its angle (the paper's class c).

    J theta'' + c theta' + k theta = R N_i mu_i(|v_i|) sgn(v_i),    v_i = r w_i - R theta'
    i = 0 where theta < theta_s,    i = 1 where theta >= theta_s

Body, discs and friction are those of ``disc_rig``; stick also ends where the body leaves its disc for the other one.

Source: Casini, Giannini, Vestroni, Nonlinear Dynamics 46 (2006), equations (21) to (26), Fig. 5, where theta_s = 0. The
paper's sequence, stick on disc 0 alone, on both in turn, on disc 1 alone as w0 grows, is met with liner/rubber and

    | N, N   | c, N m s/rad | theta_s, rad | w1, rad/s | w0 of appearance | w0 of disappearance |
    |--------|--------------|--------------|-----------|------------------|---------------------|
    | 3.0621 | 0.0055       | 0            | 1.15      | 0.5951           | 1.100               |
    | 5.5    | 0.055        | 0.068914     | 1.15      | 0.9199           | 1.100               |

With theta_s = 0 and c = 0.055 N m s/rad the motion stays on disc 1, hence the default. At N = 5.5 N that body may also
come to rest on disc 1, from starts near theta = 0.1 rad.
"""

from fmu_models.language.quantities import Parameter
from fmu_models.oscillators.disc_rig import disc, rig, theta

theta_s = Parameter("theta_s", 0.068914, "rad", "angle from which on disc 1 is touched instead of disc 0")

MODEL = rig(
    "disc_rig_sequential",
    "Rotational oscillator against one of two driven discs at a time",
    disc(0, speed=0.9, where=theta_s - theta),
    disc(1, speed=1.15, where=theta - theta_s),
)
