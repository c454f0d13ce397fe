"""Rules in which one value asks for less than the defaults: one for every rule and every value in one."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

from bimvox.site.config.rules import MORE_IS_WEAKER, NONE_IS_WEAKER, RulesConfig
from bimvox.site.default_rules import FlipRules, TandemRules
from bimvox.site.site import SwingRule

DEFAULT = RulesConfig().rules(has_crane=True)


def less_of(value: Any, key: str) -> Any:
    """Return a value that asks for less."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, SwingRule):
        return SwingRule.OFF
    return value + 1.0 if key in MORE_IS_WEAKER else value - 0.25


def weakened(rules: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield rules in which one value asks for less, with its key."""
    for field in dataclasses.fields(rules):
        value = getattr(rules, field.name)
        if field.name == "two_hooks":
            value = value or FlipRules()
        if field.name == "tandem":
            value = value or TandemRules()
        if field.name in NONE_IS_WEAKER:
            continue
        if dataclasses.is_dataclass(value):
            for key, inner in weakened(value, f"{prefix}{field.name}."):
                yield key, dataclasses.replace(rules, **{field.name: inner})
        else:
            other = less_of(value, field.name)
            yield f"{prefix}{field.name}", dataclasses.replace(rules, **{field.name: other})


EVERY = dict(weakened(DEFAULT))
"""By key."""
