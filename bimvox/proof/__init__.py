"""The proof of a plan, independent of the planner."""
