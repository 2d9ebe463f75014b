"""Types of the arrays that solvers and files hand over: C order, as kernels take them."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int32]
