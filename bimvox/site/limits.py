"""The largest values that a rule can have: the site file refuses more, and so does the proof."""

from __future__ import annotations

MOST_CONTACT_TOLERANCE_M = 0.1
"""More is not a tolerance: parts would be set into each other."""
MOST_SUPPORT_GAP_M = 1.0
MOST_SAMPLE_PERIOD_S = 60.0
