"""The device that a network is trained on, taken at its word."""

from __future__ import annotations

import torch

from bimvox.errors import PolicyError


def device_named(name: str) -> torch.device:
    """Return a device that is there and computes.

    Stable-baselines3 takes the processor, without a word, where the GPU that was asked for is missing, and any GPU for
    ``auto``. The weights depend on the device, so their record must not name one that they were not trained on.

    Args:
        name: As torch names it: ``cpu``, ``cuda``, ``cuda:1``.

    Raises:
        PolicyError: Torch knows no such device, or this machine or this build of torch has none.
    """
    try:
        device = torch.device(name)
        torch.zeros(1, device=device).item()
    except (RuntimeError, AssertionError) as error:  # a build of torch without CUDA answers with an AssertionError
        raise PolicyError(
            f"device {name!r} cannot be trained on: {str(error).splitlines()[0]}",
            differs={"device": name},
            hint="cpu is always there; cuda needs an NVIDIA GPU, its driver and a build of torch for it",
        ) from error
    return device
