"""The device on which a network is trained, checked."""

from __future__ import annotations

import torch

from bimvox.errors import PolicyError


def device_named(name: str) -> torch.device:
    """Return a device after a computation on it.

    If the requested GPU is missing, stable-baselines3 silently uses the processor; for ``auto`` it takes any GPU. The
    weights depend on the device, so their record must name the device on which they were trained.

    Args:
        name: As torch names it: ``cpu``, ``cuda``, ``cuda:1``.

    Raises:
        PolicyError: Torch does not know the device, or this machine or build of torch does not have it.
    """
    try:
        device = torch.device(name)
        torch.zeros(1, device=device).item()
    except (RuntimeError, AssertionError) as error:  # a build of torch without CUDA answers with an AssertionError
        raise PolicyError(
            f"device {name!r} cannot be trained on: {str(error).splitlines()[0]}",
            differs={"device": name},
            hint="cpu is always available; cuda needs an NVIDIA GPU, its driver and a build of torch for it",
        ) from error
    return device
