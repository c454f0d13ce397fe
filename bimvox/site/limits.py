"""Limits: the largest values that a rule can have (the site file and the proof refuse more), and what goes by road."""

from __future__ import annotations

MOST_CONTACT_TOLERANCE_M = 0.1
"""More is not a tolerance: parts would be set into each other."""
MOST_SUPPORT_GAP_M = 1.0
MOST_SAMPLE_PERIOD_S = 60.0

MOST_WORK_S = 365 * 86_400.0
"""The longest work at a part that is cast in place; only a mass that makes no sense asks for more."""

ROAD_KG = 70_000.0
"""The heaviest precast girders that go by road as a single load (professional judgement)."""
ROAD_LENGTH_M = 40.0
"""The longest girders on a steered dolly (professional judgement)."""
ROAD_WIDTH_M = 5.5
"""Wider than two lanes of a main road less their margins (professional judgement)."""
ROAD_HEIGHT_M = 4.0
"""4.7 m under most bridges less a low bed's deck of 0.7 m (professional judgement)."""

FEW_HANDS_KG = 75.0
"""What three people or a small hoist handle; a crane lifts such parts by the bundle (professional judgement)."""

ON_GROUND_M = 0.3
"""What begins lower lies on the ground."""
FAR_FROM_GROUND_M = 100.0
"""No model of upper storeys alone begins further above the ground, and none ends further below it."""
