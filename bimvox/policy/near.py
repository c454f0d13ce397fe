"""Stored policies of the same building, whose crane, yard or rules differ a little: another geometry, but hardly."""

from __future__ import annotations

from bimvox.policy import store
from bimvox.policy.manifest import PolicyManifest, outline_of
from bimvox.site.site import Site

CLOSE = 0.1
"""Largest distance of such a site, for example of a grid that grows by 20 % along one axis."""


def of_same_building(site: Site) -> tuple[tuple[float, PolicyManifest], ...]:
    """Return the fitting policies of sites with as many parts, the same cells and nearly the same outline.

    They come with their distances, nearest first. Policies of exactly this geometry are left out.
    """

    def is_alike(manifest: PolicyManifest) -> bool:
        other = manifest.site
        return (
            other is not None
            and manifest.geometry_key != site.geometry_digest
            and (other.components, other.voxel_size_m) == (len(site.components), site.frame.voxel_size_m)
        )

    if not any(map(is_alike, store.scan().manifests)):
        return ()  # the outline of a large site takes a while
    near = store.nearest(outline_of(site))
    return tuple((away, manifest) for away, manifest in near if away <= CLOSE and is_alike(manifest))
