"""Outcomes of a training in another process, which finds these functions by name."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from bimvox.policy.choice import PolicyInUse


def better(_site: Any, _preparation: Any, policy: PolicyInUse, **_: Any) -> PolicyInUse:
    """Return a policy with another id."""
    return replace(policy, id="better")


def unchanged(_site: Any, _preparation: Any, policy: PolicyInUse, **_: Any) -> PolicyInUse:
    """Return the previous policy."""
    return policy


def broken(*_: Any, **__: Any) -> PolicyInUse:
    """Fail."""
    raise ValueError("no lessons")


def endless(*_: Any, **__: Any) -> PolicyInUse:
    """Take longer than any test."""
    time.sleep(600.0)
    raise AssertionError
