"""Parts whose mass is odd for the volume that they enclose."""

from __future__ import annotations

from collections.abc import Iterator

from bimvox.proof.mass import volumes_of
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, about, tonnes

DENSITY = "density"

LIGHT_KG_M3, VERY_LIGHT_KG_M3 = 60.0, 20.0
"""Insulation boards weigh 15 to 60 kg/m3, panels with faces of sheet steel 80 and more (data sheets)."""
DENSE_KG_M3, VERY_DENSE_KG_M3 = 9_000.0, 12_000.0
"""Steel weighs 7,850 kg/m3, copper 8,900 and lead 11,300 (EN 1991-1-1, table A.4)."""


def density(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part of a closed mesh that is lighter than a panel or denser than steel."""
    for component in subject.lifted:
        found, mass_kg = volumes_of(component.mesh), component.mass_kg
        if found.least_m3 and mass_kg < LIGHT_KG_M3 * found.least_m3:
            very, kg_m3 = mass_kg < VERY_LIGHT_KG_M3 * found.least_m3, mass_kg / found.least_m3
            said = f"{kg_m3:.0f} kg/m3 of what it encloses: lighter than a building part, unless it is hollow"
        elif mass_kg > DENSE_KG_M3 * found.most_m3:
            very, kg_m3 = mass_kg > VERY_DENSE_KG_M3 * found.most_m3, mass_kg / found.most_m3
            said = f"{kg_m3:,.0f} kg/m3 of what it encloses: denser than steel"
        else:
            continue
        severity = Severity.SERIOUS if very else Severity.MINOR
        yield about(component, DENSITY, severity, f"weighs {tonnes(mass_kg)}, {said}; check its mass")
