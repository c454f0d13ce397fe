"""The policy that knows sites it has never seen: how its lessons, its tests and its weights are made."""
