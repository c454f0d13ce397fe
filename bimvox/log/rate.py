"""How densely a log shows its motions to viewers. Its exact samples are in it at every rate."""

from __future__ import annotations

from enum import StrEnum


class LogRate(StrEnum):
    """Which samples the topics for viewers have."""

    MOTION = "motion"
    """Those that the motion needs: :mod:`bimvox.log.needed` says which."""
    FULL = "full"
    """Every sample; commands once a period of the site's rules."""
    EARLIER = "earlier"
    """As ``FULL``, in a log of schema version 1: its joint states are the exact samples. Never written anew."""
