"""Array types used across the package."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
"""A float64 array; its shape stands in the docstring of whoever takes or returns it."""

IntArray: TypeAlias = npt.NDArray[np.intp]
"""An array of indices."""

BoolArray: TypeAlias = npt.NDArray[np.bool_]
"""A mask."""
