"""A trained network on disk: safetensors for the weights, JSON for everything else; reading one runs no code.

::

    <name>.safetensors    the network's arrays
    <name>.json           configuration, seed, steps, curve, SHA-256 of the weights
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.numpy import load as arrays_from_bytes
from safetensors.numpy import save as bytes_from_arrays

from bimvox.errors import PolicyError
from bimvox.paper.policy.config import paper_config_from_dict
from bimvox.paper.policy.initialization import BasicPolicy
from bimvox.paper.policy.learning import CurvePoint
from bimvox.paper.policy.network import PaperNetwork, paper_network_from_arrays
from bimvox.policy.limited import read_limited

FORMAT_VERSION = 1
LARGEST_FILE_BYTES = 256 << 20


def network_to_bytes(network: PaperNetwork) -> bytes:
    """Return a network as the bytes of a safetensors file."""
    return bytes(bytes_from_arrays(network.arrays()))


def network_from_bytes(content: bytes) -> PaperNetwork:
    """Return the network of :func:`network_to_bytes`.

    Raises:
        PolicyError: The bytes are not a network's.
    """
    try:
        arrays = arrays_from_bytes(content)
    except (SafetensorError, ValueError, TypeError, KeyError) as error:
        raise PolicyError(f"not a safetensors file: {error}") from error
    return paper_network_from_arrays(arrays)


def basic_policy_to_dict(policy: BasicPolicy, weights: bytes) -> dict[str, Any]:
    """Return everything but the weights as plain values for JSON."""
    return {
        "format_version": FORMAT_VERSION,
        "weights_sha256": hashlib.sha256(weights).hexdigest(),
        "reached": policy.reached,
        "steps": policy.steps,
        "curve": [list(point) for point in policy.curve],
        "config": policy.config.to_dict(),
        "seed": policy.seed,
    }


def basic_policy_from_dict(plain: dict[str, Any], weights: bytes) -> BasicPolicy:
    """Return the policy of :func:`basic_policy_to_dict` and of its weights.

    Raises:
        PolicyError: The two do not belong together, or one is damaged or of another version.
    """
    if plain.get("format_version") != FORMAT_VERSION:
        raise PolicyError(
            f"the policy has format version {plain.get('format_version')!r}; this version reads {FORMAT_VERSION}",
            differs={"format_version": (plain.get("format_version"), FORMAT_VERSION)},
        )
    if plain.get("weights_sha256") != hashlib.sha256(weights).hexdigest():
        raise PolicyError("the weights are not those that the description was written for")
    try:
        return BasicPolicy(
            network_from_bytes(weights),
            bool(plain["reached"]),
            tuple(curve_point(row) for row in plain["curve"]),
            int(plain["steps"]),
            paper_config_from_dict(plain["config"]),
            int(plain["seed"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise PolicyError(f"the policy's description holds no, or an impossible, {error}") from error


def curve_point(row: list[Any]) -> CurvePoint:
    """Return a test from its plain values."""
    steps, rate, reward, greedy = row
    return CurvePoint(int(steps), float(rate), float(reward), None if greedy is None else float(greedy))


def save_basic_policy(policy: BasicPolicy, path: Path) -> None:
    """Write a policy as two files beside each other, ``path`` with the suffixes ``.safetensors`` and ``.json``."""
    weights = network_to_bytes(policy.network)
    path.with_suffix(".safetensors").write_bytes(weights)
    text = json.dumps(basic_policy_to_dict(policy, weights), indent=2, sort_keys=True, allow_nan=False)
    path.with_suffix(".json").write_text(text + "\n", encoding="utf-8")


def load_basic_policy(path: Path) -> BasicPolicy:
    """Read the policy of :func:`save_basic_policy`.

    Raises:
        PolicyError: A file is missing, too large, damaged or of another version.
    """
    weights, description = (
        read_limited(path.with_suffix(suffix), LARGEST_FILE_BYTES) for suffix in (".safetensors", ".json")
    )
    try:
        plain = json.loads(description.decode())
    except (ValueError, RecursionError) as error:
        raise PolicyError(f"{path.with_suffix('.json')}: not JSON: {error}") from error
    if not isinstance(plain, dict):
        raise PolicyError(f"{path.with_suffix('.json')}: not a JSON object")
    return basic_policy_from_dict(plain, weights)
