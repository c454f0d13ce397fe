"""The manifest of a stored policy: what was learned, how, and on which site."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.env.observation import VIEW_NAME as OBSERVATION_NAME
from bimvox.env.observation import VIEW_SIZE as OBSERVATION_SIZE
from bimvox.errors import PolicyError
from bimvox.grid.frame import Label
from bimvox.policy.config import DqnConfig, config_from_dict
from bimvox.policy.network import QNetwork
from bimvox.site.site import Site

BLOCKS = (8, 8, 4)
"""Blocks of the sketch along x, y and z, for any site."""


@dataclass(frozen=True, slots=True)
class SiteOutline:
    """A site in a few numbers, without its obstructions, which change.

    Attributes:
        shape_vox: (X, Y, Z) cells of the grid.
        voxel_size_m: Edge of a cell.
        components: Number of lifted parts.
        longest_vox: Longest edge of their bounding boxes.
        rope: Whether the rope above a load must be free.
        sketch: Share of every block filled by the finished building and the structure, 0 to 255, as hexadecimal digits
            (x slowest, z fastest).
    """

    shape_vox: tuple[int, int, int]
    voxel_size_m: float
    components: int
    longest_vox: int
    rope: bool
    sketch: str

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {**asdict(self), "shape_vox": list(self.shape_vox)}


def outline_of(site: Site) -> SiteOutline:
    """Return the outline of a site."""
    filled = site.labels == Label.STRUCTURE
    for component in site.components:
        cells = component.shape.cells + np.array(component.target_vox)
        filled[tuple(cells.T)] = True
    return SiteOutline(
        site.shape,
        site.frame.voxel_size_m,
        len(site.components),
        max(max(component.shape.size_vox) for component in site.components),
        bool(site.cranes) and site.rules.rope,
        _sketch(filled).tobytes().hex(),
    )


def outline_from_dict(plain: Mapping[str, Any]) -> SiteOutline:
    """Return the outline of :meth:`SiteOutline.to_dict`.

    Raises:
        PolicyError: A key is missing or unknown, or a value is impossible.
    """
    try:
        x, y, z = (int(n) for n in plain["shape_vox"])
        outline = SiteOutline(**{**plain, "shape_vox": (x, y, z)})
        sketch = bytes.fromhex(outline.sketch)
        possible = min(x, y, z, outline.components, outline.longest_vox) > 0 and outline.voxel_size_m > 0
    except (KeyError, TypeError, ValueError) as error:
        raise PolicyError(f"the outline of the policy's site cannot be read: {error}") from error
    if len(sketch) != math.prod(BLOCKS) or not possible:
        raise PolicyError("the outline of the policy's site holds impossible values")
    return outline


def distance(a: SiteOutline, b: SiteOutline) -> float:
    """Return the distance of two sites: 0 for equal outlines, about 1 for sites with little in common.

    It is the sum of: the mean difference of the sketches (0 to 1); the mean logarithmic ratio (base 2) of the grids'
    edges; that of the cells; a quarter of those of the number of parts and of the longest part; 1 if only one has a
    rope rule. It is a metric, because each term is one.
    """
    edges = np.mean([abs(math.log2(p / q)) for p, q in zip(a.shape_vox, b.shape_vox, strict=True)])
    cell = abs(math.log2(a.voxel_size_m / b.voxel_size_m))
    parts = abs(math.log2(a.components / b.components)) + abs(math.log2(a.longest_vox / b.longest_vox))
    sketches = np.mean(np.abs(_shares(a) - _shares(b)))
    return float(sketches + edges + cell + 0.25 * parts + (a.rope != b.rope))


def _shares(outline: SiteOutline) -> NDArray[np.float64]:
    return np.frombuffer(bytes.fromhex(outline.sketch), np.uint8) / 255.0


def _sketch(filled: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return (8, 8, 4) uint8 shares; sites smaller than the blocks repeat cells."""
    table = np.zeros(np.array(filled.shape) + 1, np.int64)
    table[1:, 1:, 1:] = filled.cumsum(0).cumsum(1).cumsum(2)
    bounds = []
    for size, blocks in zip(filled.shape, BLOCKS, strict=True):
        low = np.arange(blocks) * size // blocks
        high = np.maximum(low + 1, (np.arange(blocks) + 1) * size // blocks)
        bounds.append((low, high))
    sums = np.zeros(BLOCKS, np.int64)
    for corner in range(8):
        ends = [bound[(corner >> axis) & 1] for axis, bound in enumerate(bounds)]
        sums += (-1) ** (3 - corner.bit_count()) * table[np.ix_(*ends)]
    volumes = np.prod(np.meshgrid(*[high - low for low, high in bounds], indexing="ij"), axis=0)
    shares: NDArray[np.uint8] = np.round(255.0 * sums / volumes).astype(np.uint8)
    return shares


class CurvePoint(NamedTuple):
    """One test during training.

    Attributes:
        steps: Environment steps so far.
        success_rate: Share of the tested starts from which the target was reached.
        length_ratio: Mean of path / shortest path over the successful ones; 0 if there are none.
    """

    steps: int
    success_rate: float
    length_ratio: float


@dataclass(frozen=True, slots=True, eq=False)
class Training:
    """How a policy was trained.

    Attributes:
        curve: Every test, the last one included.
        steps: Environment steps taken in all.
        success_rate: Of the network that was kept, the best one tested, in its test.
        length_ratio: Mean path / shortest path in that test.
        tested: Number of starts of that test.
        config: The choices.
        seed: The seed.
        parent: Id of the policy that training started from, if any.
        budget: Environment steps allowed. None if a time limit ended the training or it was resumed, so that the same
            choices may not reproduce it.
    """

    curve: tuple[CurvePoint, ...] = field(default=(), repr=False)
    steps: int = 0
    success_rate: float = 0.0
    length_ratio: float = field(default=0.0, repr=False)
    tested: int = 0
    config: DqnConfig = field(default=DqnConfig(), repr=False)
    seed: int = field(default=0, repr=False)
    parent: str | None = None
    budget: int | None = field(default=None, repr=False)

    def training(self) -> dict[str, Any]:
        """Return these values by name, for another record of the same training."""
        return {each.name: getattr(self, each.name) for each in fields(Training)}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TrainedPolicy(Training):
    """A policy and how it was trained."""

    network: QNetwork


@dataclass(frozen=True, slots=True, eq=False)
class TrainingStart:
    """Where a training starts; from scratch without arguments.

    Attributes:
        network: Network to start from. It is tested first, and returned as it is if it is good enough.
        parent: Its id, for the record.
        resumed: A checkpoint of an interrupted training with the same problems, config, seed and parent. Its steps
            count as used, and its curve is continued.
        anyway: Whether to train even if the network is good enough. The best network of the training is kept then,
            which may be worse; the initial one is tested for the curve alone.
    """

    network: QNetwork | None = None
    parent: str | None = None
    resumed: TrainedPolicy | None = None
    anyway: bool = False


FROM_SCRATCH = TrainingStart()


_FORMAT_VERSION = 3
"""Increased when the meaning of a stored policy changes. 2: the outline of the site; 3: the training's budget. Older
versions are read without them."""

_SINCE = {"site": 2, "budget": 3}

_ID = re.compile(r"[0-9a-f]{16}")


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicyManifest(Training):
    """A policy without its weights.

    Attributes:
        id: Hash of the weights and of everything below: 16 hexadecimal digits.
        format_version: ``_FORMAT_VERSION`` of the version that wrote it.
        geometry_key: Digest of the site's geometry for which it was trained.
        observation: ``OBSERVATION_NAME`` with which it was trained.
        observation_size: Entries of that vector.
        layer_sizes: Widths from input to output.
        weights_sha256: Of the file with the weights.
        versions: Versions of the libraries that trained it.
        site: Outline of the site for which it was trained, if known.
    """

    id: str
    format_version: int
    geometry_key: str
    observation: str
    observation_size: int
    layer_sizes: tuple[int, ...]
    weights_sha256: str
    versions: Mapping[str, str]
    site: SiteOutline | None = None

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
        format_version=_FORMAT_VERSION,
        geometry_key=geometry_key,
        observation=OBSERVATION_NAME,
        observation_size=OBSERVATION_SIZE,
        layer_sizes=policy.network.layer_sizes,
        weights_sha256=hashlib.sha256(weights).hexdigest(),
        versions=_versions(),
        site=site,
        **policy.training(),
    )
    return replace(manifest, id=id_of(manifest.to_dict()))


def id_of(plain: Mapping[str, Any]) -> str:
    """Return the hash of a manifest without its id; it covers the weights through their own hash."""
    rest = {key: value for key, value in plain.items() if key != "id"}
    return hashlib.sha256(canonical_json(rest).encode()).hexdigest()[:16]


def _versions() -> dict[str, str]:
    """Return the versions of the libraries on which a trained network depends."""
    result = {}
    for name in ("bimvox", "numpy", "stable-baselines3", "torch"):
        try:
            result[name] = version(name)
        except PackageNotFoundError:
            result[name] = "not installed"
    return result


def manifest_from_dict(plain: Any) -> PolicyManifest:
    """Return the manifest of :meth:`PolicyManifest.to_dict`.

    Raises:
        PolicyError: It is not a manifest, or its format is unknown to this version.
    """
    if not isinstance(plain, dict):
        raise PolicyError("the manifest is not a JSON object")
    written = plain.get("format_version")
    if not isinstance(written, int) or written not in range(1, _FORMAT_VERSION + 1):
        raise PolicyError(
            f"the policy has format version {written!r}; this version reads 1 to {_FORMAT_VERSION}",
            differs={"format_version": (written, _FORMAT_VERSION)},
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
