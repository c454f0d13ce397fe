"""A new plan after a change of the obstructions."""
