"""How densely a log shows its motions to viewers. Its exact samples are in it at every rate."""

from __future__ import annotations

from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

_STEPS = 2.0**30
"""Viewers are shown values in such parts of a metre or radian, about a nanometre: finer ones compress badly."""


class LogRate(StrEnum):
    """Which samples the topics for viewers have."""

    MOTION = "motion"
    """Those that the motion needs: :mod:`bimvox.log.driven` says which."""
    FULL = "full"
    """Every sample; commands once a period of the site's rules."""


def shown_values(exact: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values as viewers are shown them."""
    return np.round(exact * _STEPS) / _STEPS + 0.0  # no negative zero
