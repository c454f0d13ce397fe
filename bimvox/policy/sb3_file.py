"""A policy's network to and from stable-baselines3's zip files, for researchers.

Stable-baselines3 loads such a file by unpickling parts of it, which runs any code in it. Here only ``policy.pth`` is
read, by torch's loader for tensors alone. The file has no manifest to check it against, so the caller must state that
it is trusted.
"""

from __future__ import annotations

import io
import re
import zipfile
from pathlib import Path
from pickle import UnpicklingError

import gymnasium
import numpy as np
import torch
from stable_baselines3 import DQN
from stable_baselines3.common.logger import Logger

from bimvox.env.actions import ACTION_COUNT
from bimvox.env.observation import VIEW_SIZE
from bimvox.errors import PolicyError
from bimvox.grid.layout import BROKEN_ZIP
from bimvox.policy.dqn import FramedPolicy, load_network
from bimvox.policy.network import QNetwork, network_from_arrays

_WEIGHTS = "policy.pth"
_LAYER = re.compile(r"q_net\.q_net\.(\d+)\.(weight|bias)")
_LARGEST_BYTES = 256 << 20


class _Shapes(gymnasium.Env[np.ndarray, np.int64]):
    """An environment without dynamics: a DQN needs only its spaces."""

    def __init__(self) -> None:
        self.observation_space = gymnasium.spaces.Box(-1.0, 1.0, (VIEW_SIZE,), np.float32)
        self.action_space = gymnasium.spaces.Discrete(ACTION_COUNT)


def write_sb3_zip(network: QNetwork, path: Path) -> None:
    """Write a network as a stable-baselines3 DQN that ``DQN.load`` reads.

    ``path``: where to; ends with ``.zip``.
    """
    sizes = network.layer_sizes
    policy = FramedPolicy if network.is_framed else "MlpPolicy"
    dqn = DQN(policy, _Shapes(), buffer_size=1, policy_kwargs={"net_arch": list(sizes[1:-1])}, device="cpu")
    dqn.set_logger(Logger(folder=None, output_formats=[]))
    load_network(dqn, network)
    dqn.save(path)


def read_sb3_zip(content: bytes) -> QNetwork:
    """Return the online network of a stable-baselines3 DQN: one of bimvox, or a stock one trained on ``Lift-v0``.

    Raises:
        PolicyError: It is not such a file, or its network does not fit this version's observation and actions.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if archive.getinfo(_WEIGHTS).file_size > _LARGEST_BYTES:
                raise PolicyError(f"{_WEIGHTS}: more than a policy can have")
            weights = archive.read(_WEIGHTS)
        named = torch.load(io.BytesIO(weights), map_location="cpu", weights_only=True)
    except (*BROKEN_ZIP, KeyError) as error:
        raise PolicyError(f"not a zip file of stable-baselines3: {error}") from error
    except UnpicklingError as error:
        raise PolicyError(
            f"{_WEIGHTS} holds more than tensors, and is not read: {str(error).splitlines()[0]}"
        ) from error
    if not isinstance(named, dict):
        raise PolicyError(f"{_WEIGHTS}: holds a {type(named).__name__}, not named tensors")
    found = {
        (int(match[1]), match[2]): tensor
        for name, tensor in named.items()
        if isinstance(tensor, torch.Tensor) and (match := _LAYER.fullmatch(str(name)))
    }
    places = sorted({place for place, _ in found})
    if not places or len(found) != 2 * len(places):
        raise PolicyError(f"{_WEIGHTS}: has no layers of a DQN with a multilayer perceptron (q_net.q_net.<n>.weight)")
    arrays: dict[str, np.ndarray] = {}
    for layer, place in enumerate(places):
        arrays[f"layer{layer}.weight"] = np.ascontiguousarray(found[place, "weight"].numpy().T)
        arrays[f"layer{layer}.bias"] = found[place, "bias"].numpy().copy()
    return network_from_arrays(arrays)
