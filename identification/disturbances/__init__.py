"""Disturbances of a real bench: one file each, with the disturbance as ``DISTURBANCE``; what several share is in files
beside.

    F = N mu(|v|) (1 + sum_n a_n cos(n phi) + b_n sin(n phi)) (1 + sum_n g_n (theta - theta_0)^n) (1 + s_i + t_i u)
    laser: sin(theta + z) + o_i + d_i1 u + d_i2 (u^2 - 1/12) + sum_n d_in cos((n - 2) pi (u + 1/2)),   n = 3 .. 6
    angle sensor: theta + z
    k (1 + k3 theta^2),   c (1 + c2 |omega|),   w (1 + sum_n e_n cos(n phi) + f_n sin(n phi))

phi angle of the drive (n = 1, 2: a disc that runs out of true, a bent shaft), theta angle of the body (n = 1, 2, 3),
i number of the log and u the share of it that is gone, from -1/2 to 1/2 (wear; s_1 = 0); w speed of the drive by its
encoder, omega that of the body; z zero of the sensor, o_i and d_in slow drift of the laser over R. So mu is the
friction at theta_0 in the middle of the first log, on average over a turn of the drive. `rig_io.bench.disturbances`
emulates them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fmu_models.base.registry import Registry

if TYPE_CHECKING:
    from identification.disturbances.disturbance import Disturbance

DISTURBANCES: Registry[Disturbance] = Registry(
    kind="disturbance",
    package=__name__,
    attribute="DISTURBANCE",
    group="stickslip.disturbances",
    types=("identification.disturbances.disturbance.Disturbance",),
    separator="-",
)
