"""The manifest of a stored policy."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from bimvox.env.observation import VIEW_NAME as OBSERVATION_NAME
from bimvox.env.observation import VIEW_SIZE as OBSERVATION_SIZE
from bimvox.errors import PolicyError
from bimvox.policy.config import DqnConfig, config_from_dict
from bimvox.policy.site_outline import SiteOutline, outline_from_dict
from bimvox.policy.trained import CurvePoint, TrainedPolicy

FORMAT_VERSION = 3
"""Increased when the meaning of a stored policy changes. 2: the outline of the site; 3: the training's budget. Older
versions are read without them."""

_SINCE = {"site": 2, "budget": 3}

_ID = re.compile(r"[0-9a-f]{16}")


@dataclass(frozen=True, slots=True)
class PolicyManifest:
    """A policy without its weights.

    Attributes:
        id: Hash of the weights and of everything below: 16 hexadecimal digits.
        format_version: ``FORMAT_VERSION`` of the version that wrote it.
        geometry_key: Digest of the site's geometry for which it was trained.
        observation: ``OBSERVATION_NAME`` with which it was trained.
        observation_size: Entries of that vector.
        layer_sizes: Widths from input to output.
        weights_sha256: Of the file with the weights.
        config: The choices of its training.
        seed: The seed.
        steps: Environment steps of its training.
        success_rate: In its last test.
        length_ratio: Mean path / shortest path in that test.
        tested: Number of starts of that test.
        curve: Every test of its training.
        parent: Id of the policy from which it was trained, if any.
        versions: Versions of the libraries that trained it.
        site: Outline of the site for which it was trained, if known.
        budget: Environment steps allowed in its training. None if its choices may not reproduce it.
    """

    id: str
    format_version: int
    geometry_key: str
    observation: str
    observation_size: int
    layer_sizes: tuple[int, ...]
    weights_sha256: str
    config: DqnConfig
    seed: int
    steps: int
    success_rate: float
    length_ratio: float
    tested: int
    curve: tuple[CurvePoint, ...]
    parent: str | None
    versions: Mapping[str, str]
    site: SiteOutline | None = None
    budget: int | None = None

    @property
    def fits(self) -> bool:
        """Whether the policy has the observation of this version of bimvox."""
        return (self.observation, self.observation_size) == (OBSERVATION_NAME, OBSERVATION_SIZE)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        plain = asdict(self)
        plain["config"] = self.config.to_dict()
        plain["layer_sizes"] = list(self.layer_sizes)
        plain["curve"] = [list(point) for point in self.curve]
        plain["versions"] = dict(self.versions)
        plain["site"] = None if self.site is None else self.site.to_dict()
        return {key: value for key, value in plain.items() if self.format_version >= _SINCE.get(key, 1)}


def is_id(text: str) -> bool:
    """Return whether a text is an id: 16 hexadecimal digits, so never a path."""
    return _ID.fullmatch(text) is not None


def canonical_json(plain: Mapping[str, Any]) -> str:
    """Return the canonical JSON of a manifest: sorted keys, two spaces, a newline at the end."""
    return json.dumps(plain, sort_keys=True, indent=2, allow_nan=False) + "\n"


def manifest_of(policy: TrainedPolicy, geometry_key: str, site: SiteOutline | None, weights: bytes) -> PolicyManifest:
    """Return the manifest of a policy, a site and the bytes of its weights."""
    manifest = PolicyManifest(
        id="",
        format_version=FORMAT_VERSION,
        geometry_key=geometry_key,
        observation=OBSERVATION_NAME,
        observation_size=OBSERVATION_SIZE,
        layer_sizes=policy.network.layer_sizes,
        weights_sha256=hashlib.sha256(weights).hexdigest(),
        config=policy.config,
        seed=policy.seed,
        steps=policy.steps,
        success_rate=policy.success_rate,
        length_ratio=policy.length_ratio,
        tested=policy.tested,
        curve=policy.curve,
        parent=policy.parent,
        versions=_versions(),
        site=site,
        budget=policy.budget,
    )
    return replace(manifest, id=id_of(manifest.to_dict()))


def id_of(plain: Mapping[str, Any]) -> str:
    """Return the hash of a manifest without its id; it covers the weights through their own hash."""
    rest = {key: value for key, value in plain.items() if key != "id"}
    return hashlib.sha256(canonical_json(rest).encode()).hexdigest()[:16]


def _versions() -> dict[str, str]:
    """Return the versions of the libraries on which a trained network depends."""
    found = {}
    for name in ("bimvox", "numpy", "stable-baselines3", "torch"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def manifest_from_dict(plain: Any) -> PolicyManifest:
    """Return the manifest of :meth:`PolicyManifest.to_dict`.

    Raises:
        PolicyError: It is not a manifest, or its format is unknown to this version.
    """
    if not isinstance(plain, dict):
        raise PolicyError("the manifest is not a JSON object")
    written = plain.get("format_version")
    if not isinstance(written, int) or written not in range(1, FORMAT_VERSION + 1):
        raise PolicyError(
            f"the policy has format version {written!r}; this version reads 1 to {FORMAT_VERSION}",
            differs={"format_version": (written, FORMAT_VERSION)},
        )
    names = {name for name in PolicyManifest.__dataclass_fields__ if written >= _SINCE.get(name, 1)}
    if set(plain) != names:
        raise PolicyError(
            "the manifest has other keys than this version's",
            differs={"missing": sorted(names - set(plain)), "unknown": sorted(set(plain) - names)},
        )
    if not (isinstance(plain["id"], str) and is_id(plain["id"])):
        raise PolicyError(f"the manifest's id is {plain['id']!r}, not 16 hexadecimal digits")
    if not isinstance(plain["config"], dict):
        raise PolicyError("the manifest's config is not a JSON object")
    if plain.get("site") is not None and not isinstance(plain["site"], dict):
        raise PolicyError("the manifest's site is not a JSON object")
    try:
        config = config_from_dict(plain["config"])
    except PolicyError:
        # Of another version: report a different observation first.
        _require_view(plain["id"], plain["observation"], plain["observation_size"])
        raise
    try:
        return PolicyManifest(
            **{
                **plain,
                "site": outline_from_dict(plain["site"]) if plain.get("site") is not None else None,
                "layer_sizes": tuple(int(n) for n in plain["layer_sizes"]),
                "config": config,
                "curve": tuple(CurvePoint(int(s), float(rate), float(ratio)) for s, rate, ratio in plain["curve"]),
                "success_rate": float(plain["success_rate"]),
                "length_ratio": float(plain["length_ratio"]),
                "versions": {str(name): str(version) for name, version in plain["versions"].items()},
            }
        )
    except (TypeError, ValueError, AttributeError) as error:
        raise PolicyError(f"the manifest holds an impossible value: {error}") from error


def require_fit(manifest: PolicyManifest) -> None:
    """Check that a policy has the observation of this version of bimvox.

    Raises:
        PolicyError: It was trained with another observation; ``differs`` has the differences.
    """
    _require_view(manifest.id, manifest.observation, manifest.observation_size)


def _require_view(policy_id: str, observation: object, size: object) -> None:
    wanted = {"observation": OBSERVATION_NAME, "observation_size": OBSERVATION_SIZE}
    has = {"observation": observation, "observation_size": size}
    differs = {key: (has[key], wanted[key]) for key in wanted if has[key] != wanted[key]}
    if differs:
        listed = ", ".join(f"{key} {mine!r} instead of {ours!r}" for key, (mine, ours) in differs.items())
        raise PolicyError(
            f"policy {policy_id} does not fit: {listed}",
            differs=differs,
            hint="train a new one with this version of bimvox",
        )
