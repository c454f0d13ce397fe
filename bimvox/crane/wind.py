"""Wind on the load: the wind speed in which a part with a large sail area may be lifted.

A crane's wind limit assumes a sail area of at most 1.2 m2 per tonne of load, drag included (EN 13000; FEM 5.016
explains the figure; here it applies to tower cranes too). A load with a larger sail area needs less wind: the force
grows with the square of the speed, so ``v = v_max * sqrt(1.2 m2/t * m / (c_w * A_p))``, as in crane manuals (for
instance Liebherr, "Influence of wind on crane operation", 4th issue, 4.3).
"""

from __future__ import annotations

from math import inf, sqrt

SAIL_AREA_M2_PER_KG = 1.2e-3
"""Sail area per load, drag included, that a crane's wind limit assumes."""
_AIR_KG_M3 = 1.25


def permitted_wind_m_s(max_wind_m_s: float, hoisted_kg: float, area_m2: float, drag: float) -> float:
    """Return the wind speed up to which a load may be lifted.

    Args:
        max_wind_m_s: The crane's own limit (gust of 3 s).
        hoisted_kg: Mass of load, rigging and hook block.
        area_m2: The load's largest sail area.
        drag: Its drag coefficient c_w: 1.1 for a cube to 2.0 for a long plate.
    """
    if area_m2 * drag <= SAIL_AREA_M2_PER_KG * hoisted_kg:
        return max_wind_m_s
    return max_wind_m_s * sqrt(SAIL_AREA_M2_PER_KG * hoisted_kg / (drag * area_m2))


def wind_force_n(speed_m_s: float, area_m2: float, drag: float) -> float:
    """Return the force of the wind on a load: c_w * A * rho * v^2 / 2, with air of 1.25 kg/m3."""
    return drag * area_m2 * 0.5 * _AIR_KG_M3 * speed_m_s**2 if speed_m_s < inf else inf
