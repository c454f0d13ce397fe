"""The site file that a log carries, with what it leaves to be chosen: chosen again, from the parts in the log."""

from __future__ import annotations

from bimvox.bim.building import Building, Element, Role, Source, TriangleMesh
from bimvox.site.component import Component
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.guess import complete_with_placed, lifted_of
from bimvox.site.site import Site

_COPY = "#"
"""Separates the GlobalId from the rest of the id of a part whose GlobalId occurs more than once."""


def building_of(site: Site, config: SiteConfig) -> Building:
    """Return the building of a site, in the site frame: parts and structure.

    Of structure only id and surface are known. What the site file pins is a component that is not lifted.
    """
    pinned = {entry.global_id for entry in config.component if entry.pinned}
    fixed = [_fixed(one.id, one.mesh, pinned) for one in site.blockers if one.kind == "structure" and one.mesh]
    lifted = [_lifted(component) for component in site.components]
    return Building((*lifted, *fixed), (), Source("", "", "", "m"))


def completed(config: SiteConfig, site: Site, building: Building) -> SiteConfig:
    """Return a site file with areas, crane and cell size filled in, as they follow from the parts of a site.

    The height of the ground in the model, if the file leaves it out, is the site's: only the model says more.

    Args:
        config: The site file.
        site: The site that is said to be made from it.
        building: Its building, see :func:`building_of`.

    Raises:
        BimvoxError: If nothing can be chosen for these parts.
    """
    if config.model.ground_m is None:
        config = config.at_ground(float(site.site_to_ifc[2, 3]))
    return complete_with_placed(config, building, lifted_of(config, building))


def _lifted(component: Component) -> Element:
    hints = component.hints
    return Element(
        id=component.id,
        global_id=component.global_id,
        ifc_class=component.ifc_class,
        name=component.name,
        mesh=component.mesh,
        role=Role.COMPONENT,
        mass_kg=component.mass_kg,
        mass_source=component.mass_source,
        storey=component.storey,
        material=component.material,
        predefined_type=component.predefined_type,
        assembly=hints.assembly,
        task=hints.task,
        task_rank=hints.task_rank,
        casting=component.casting,
        volume_guessed=component.volume_guessed,
        judgement=component.judgement,
        stated_means=component.stated_means,
    )


def _fixed(name: str, mesh: TriangleMesh, pinned: set[str]) -> Element:
    global_id = name if name in pinned else name.rpartition(_COPY)[0] or name
    role = Role.COMPONENT if global_id in pinned else Role.STRUCTURE
    return Element(name, global_id, "", name, mesh, role, 0.0, "")
