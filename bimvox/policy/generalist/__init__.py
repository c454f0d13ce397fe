"""The policy for sites that it has never seen: its lessons, its tests and its weights."""
