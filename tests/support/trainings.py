"""What a training in another process may come to; the process finds these functions by name."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from bimvox.policy.choice import PolicyInUse


def better(_site: Any, _preparation: Any, policy: PolicyInUse, **_: Any) -> PolicyInUse:
    """A policy with another id."""
    return replace(policy, id="better")


def unchanged(_site: Any, _preparation: Any, policy: PolicyInUse, **_: Any) -> PolicyInUse:
    """The policy before."""
    return policy


def broken(*_: Any, **__: Any) -> PolicyInUse:
    """A training that fails."""
    raise ValueError("no lessons")


def endless(*_: Any, **__: Any) -> PolicyInUse:
    """A training that takes longer than any test."""
    time.sleep(600.0)
    raise AssertionError
