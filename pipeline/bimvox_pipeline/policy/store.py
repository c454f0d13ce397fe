"""The policy store, as ``bimvox policy`` shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bimvox.policy.manifest import PolicyManifest


def list_policies() -> dict[str, Any]:
    """Return the store's folder, the policies in it, and the damaged ones with the reason."""
    from bimvox.policy import store

    found = store.scan()
    return {
        "store": str(store.store_folder()),
        "policies": [_summary(manifest) for manifest in found.manifests],
        "damaged": [{"id": name, "reason": reason} for name, reason in found.damaged],
    }


def show(policy_id: str) -> dict[str, Any]:
    """Return the manifest of a policy, after checking its weights.

    Raises:
        PolicyError: If there is no such policy, or it is damaged.
    """
    from bimvox.policy import store

    return {"kind": "policy", **store.load(policy_id).manifest.to_dict()}


def remove(policy_id: str) -> dict[str, Any]:
    """Remove a policy from the store.

    Raises:
        PolicyError: If there is no such policy, or it cannot be removed.
    """
    from bimvox.policy import store

    return {"store": str(store.store_folder()), "removed": store.remove(policy_id)}


def _summary(manifest: PolicyManifest) -> dict[str, Any]:
    return {
        "id": manifest.id,
        "steps": manifest.steps,
        "success_rate": manifest.success_rate if manifest.tested else None,
        "length_ratio": manifest.length_ratio if manifest.tested else None,
        "tested": manifest.tested,
        "seed": manifest.seed,
        "parent": manifest.parent,
        "geometry_key": manifest.geometry_key,
    }
