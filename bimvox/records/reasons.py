"""How the reasons begin that make a lift infeasible although a path may lead to its place.

All other reasons come from the planner's search: they follow from the site, the order, and what is in place.
"""

from __future__ import annotations

NOT_PROVEN = "its lift could not be proven: "
NOT_PROVEN_TOGETHER = f"{NOT_PROVEN}together with the other lifts"
NOT_DRIVEN = "the crane cannot drive its path: "
HOOK_CANNOT_LEAVE = "the hook cannot leave where the last part was set: "
HOOK_MET = (
    "the empty hook met something while it was stopped, or as far out as it swings: look at it before it is moved"
)
LOAD_IS_HELD = "it is held "

NOT_ITS_CELLS = f"{NOT_PROVEN}shapes: "
"""The lift was refused because the part's cells do not fit its surface: they are taken as they are, a condition."""

OF_THE_PATH = (NOT_PROVEN, NOT_DRIVEN)
"""A path was found, but it, or its motion, was refused."""
OF_A_STOP = (HOOK_CANNOT_LEAVE, HOOK_MET, LOAD_IS_HELD)
"""The plan was being carried out, and its cranes are stopped."""
