"""The work of processes that use one policy store at the same time."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from bimvox.env.observation import INPUT_SIZE
from bimvox.policy import store
from bimvox.policy.config import DqnConfig
from bimvox.policy.manifest import CurvePoint, TrainedPolicy
from bimvox.policy.network import QNetwork


def small_policy(seed: int) -> TrainedPolicy:
    random = np.random.default_rng(seed)
    sizes = (INPUT_SIZE, 4, 6)
    network = QNetwork(
        tuple(random.standard_normal((a, b)).astype(np.float32) for a, b in itertools.pairwise(sizes)),
        tuple(random.standard_normal(b).astype(np.float32) for b in sizes[1:]),
    )
    return TrainedPolicy(
        (CurvePoint(2000, 1.0, 1.0),), 2000, 1.0, 1.0, 9, DqnConfig(hidden=(4,)), seed, network=network
    )


def use_store(folder: Path, times: int) -> list[str]:
    """Save, find and load the same few policies repeatedly; return what was loaded but not saved."""
    wrong = []
    for n in range(times):
        saved = small_policy(n % 5)
        identity = store.save(saved, f"site-{n % 5}", folder=folder)
        found = [manifest.id for manifest in store.find(f"site-{n % 5}", folder=folder)]
        loaded = store.load(identity, folder=folder).network.arrays()
        same = all(np.array_equal(array, loaded[name]) for name, array in saved.network.arrays().items())
        if found != [identity] or not same or store.scan(folder=folder).damaged:
            wrong.append(f"round {n}: {found}, {identity}, {same}, {store.scan(folder=folder).damaged}")
    return wrong
