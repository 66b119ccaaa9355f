"""Columns of derivatives are close, whatever their sizes."""

from __future__ import annotations

import numpy as np


def close(found, expected, accuracy):
    """Whether arrays agree relative to the largest entry of each column."""
    found, expected = np.asarray(found), np.asarray(expected)
    size = np.maximum(np.abs(expected).max(axis=0), 1e-6 * np.abs(expected).max())
    return bool((np.abs(found - expected) <= accuracy * size).all())
