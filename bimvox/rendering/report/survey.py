"""What a surveyor sets out: cranes, yard, construction area and zones in map coordinates."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from bimvox.rendering.page.source import Revision
from bimvox.rendering.plain import escape
from bimvox.rendering.report.html import number, paragraph, row, section, table, tag
from bimvox.site.config.site_config import ModelConfig, SiteConfig
from bimvox.site.map_frame import map_of_model, set_out

_GEOREFERENCE = "georeference"
"""Key of a log's metadata: the model's map conversion as JSON."""
_ZONE = {
    "prohibited": "no hook above",
    "no_load": "no load above",
    "public": "neither hook nor load above",
    "slow": "reduced rates",
    "limiter": "hook height limited",
    "assembly": "assembly zone",
}


def survey_of(revision: Revision, areas: dict[str, Any]) -> dict[str, Any] | None:
    """Return what is set out, in map coordinates: ``set_out`` with ``crs``; None if the model has no map conversion.

    Args:
        revision: The plan.
        areas: The outlines of the drawing, for areas that the site file leaves to be chosen.
    """
    site = revision.plan.site
    to_map = map_of_model(revision.metadata.get(_GEOREFERENCE, ""), site.source)
    if to_map is None:
        return None
    config = revision.config or SiteConfig(model=ModelConfig(path=Path("model")))
    chosen = {"yard": areas.get("yard"), "construction": next(iter(areas.get("construction", ())), None)}
    missing = {key: value for key, value in chosen.items() if getattr(config.areas, key) is None}
    config = config.model_copy(update={"areas": config.areas.model_copy(update=missing)})
    crs = None
    with suppress(ValueError, AttributeError):
        crs = json.loads(revision.metadata[_GEOREFERENCE]).get("crs")
    return {"crs": crs, **set_out(config, site.cranes, site.site_to_ifc, to_map)}


def survey(record: dict[str, Any]) -> str:
    """Return the section of map coordinates; empty if the model has no map conversion."""
    found = record["survey"]
    if found is None:
        return ""
    points: list[tuple[str, str, Sequence[float]]] = [
        (f"{name}, slewing axis", "", at) for name, at in found["cranes"].items()
    ]
    rings = [("yard" if len(found["yard"]) == 1 else f"yard {n}", one) for n, one in enumerate(found["yard"], 1)]
    access = found.get("access", [])
    rings += [("access" if len(access) == 1 else f"access {n}", one) for n, one in enumerate(access, 1)]
    rings += [("construction area", found["construction"])] if found["construction"] else []
    rings += [(_zone(n, one), one["corners"]) for n, one in enumerate(found["zones"], 1)]
    points += [(name, str(n), at) for name, ring in rings for n, at in enumerate(ring, 1)]
    rows = [
        row([escape(name), corner, *(number(value, f"{value:.3f}", key) for key, value in zip("ENH", at, strict=True))])
        for name, corner, at in points
    ]
    crs = f" in {found['crs']}" if found["crs"] else ""
    about = (
        f"Easting, northing and height in metres{crs}, by the model's map conversion; heights are those of the ground "
        "(z = 0), of a crane that of its foot. A surveyor checks the conversion against a point on the site."
    )
    shown = table(("Point", "Corner", "E m", "N m", "H m"), rows, class_="words narrow", id_="survey-points")
    return section("Setting out", paragraph(about, "faint"), tag("div", shown, "wide"), id="survey")


def _zone(number_: int, zone: dict[str, Any]) -> str:
    return f"zone {number_}: {zone['name'] or _ZONE[zone['kind']]}"
