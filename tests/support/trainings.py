"""Outcomes of a training in another process, which finds these functions by name."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from bimvox.policy.choice import PolicyInUse

MAY_END = "TRAINING_MAY_END"
"""Environment variable that names a file: while it is missing, no training ends."""


def wait_until_told() -> None:
    """Wait for the file: a training that ends at once is told of with the change that began it."""
    while not Path(os.environ[MAY_END]).exists():
        time.sleep(0.02)


def better(_site: Any, _preparation: Any, policy: PolicyInUse, **_: Any) -> PolicyInUse:
    """Return a policy with another id."""
    wait_until_told()
    return replace(policy, id="better")


def unchanged(_site: Any, _preparation: Any, policy: PolicyInUse, **_: Any) -> PolicyInUse:
    """Return the previous policy."""
    wait_until_told()
    return policy


def broken(*_: Any, **__: Any) -> PolicyInUse:
    """Fail."""
    wait_until_told()
    raise ValueError("no lessons")


def endless(*_: Any, **__: Any) -> PolicyInUse:
    """Take longer than any test."""
    time.sleep(600.0)
    raise AssertionError
