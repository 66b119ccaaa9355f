"""How two driving discs touch the disc, which its angle decides (classes b, c, d of the disc_rig paper, section 2.1).

| arrangement | disc 0 touches   | disc 1 touches    | changeover, rad |
|-------------|------------------|-------------------|-----------------|
| together    | always           | always            | -               |
| sequential  | theta < theta_s  | theta >= theta_s  | theta_s         |
| overlapping | theta <= alpha   | theta >= -alpha   | alpha           |
"""

from collections.abc import Mapping
from typing import Literal

Arrangement = Literal["together", "sequential", "overlapping"]

# the model of each, and its parameter that says where contact changes
MODELS: Mapping[Arrangement, str] = {
    "together": "disc_rig",
    "sequential": "disc_rig_sequential",
    "overlapping": "disc_rig_overlapping",
}
CHANGEOVER: Mapping[Arrangement, str] = {"sequential": "theta_s", "overlapping": "alpha"}
