"""The weights that ship with the package: half precision, safetensors, with a JSON record of their training."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load as arrays_from_bytes

from bimvox.env.observation import VIEW_NAME
from bimvox.errors import PolicyError
from bimvox.policy.network import QNetwork, network_from_arrays

FOLDER = Path(__file__).parents[1] / "weights"
NAME = "generalist"


def generalist_record(folder: Path = FOLDER) -> dict[str, Any]:
    """Return the record of the shipped weights' training."""
    record: dict[str, Any] = json.loads((folder / f"{NAME}.json").read_text())
    return record


@cache
def load_generalist(folder: Path = FOLDER) -> QNetwork:
    """Return the shipped network.

    Raises:
        PolicyError: It is missing, damaged, or made for another view.
    """
    file = folder / f"{NAME}.safetensors"
    try:
        content = file.read_bytes()
        record = generalist_record(folder)
        arrays = arrays_from_bytes(content)
    except (OSError, ValueError, SafetensorError) as error:
        raise PolicyError(
            f"{file}: the built-in policy cannot be read: {error}", hint="install bimvox again"
        ) from error
    if hashlib.sha256(content).hexdigest() != record["weights_sha256"]:
        raise PolicyError(f"{file}: it is not what {NAME}.json describes", hint="install bimvox again")
    if record["observation"] != VIEW_NAME:
        raise PolicyError(
            f"{file}: made for the view {record['observation']}, this version has {VIEW_NAME}",
            differs={"observation": (record["observation"], VIEW_NAME)},
            hint="make train-generalist makes one for this version",
        )
    return network_from_arrays({name: array.astype(np.float32) for name, array in arrays.items()})
