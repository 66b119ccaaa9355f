"""Hinge with clearance, scaled, with stops that cannot pull.

``hinge_clearance`` but for the end of a contact, which comes where F falls to zero if that is before |x| = delta. It
matters after very slow entries only: no motion and no threshold of the paper changes.
"""

from fmu_models.oscillators.hinge_clearance import hinge

MODEL = hinge("hinge_clearance_clamped", release="force")
