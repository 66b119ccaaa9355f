"""Arrays by what they hold."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]
Varied = Mapping[str, Vector]  # values (m,) of parameters by name, one per run
