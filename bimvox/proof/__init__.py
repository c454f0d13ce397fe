"""Everything that ``verify`` does: the proof of a plan, independent of the planner.

It imports only records, grid, site and crane, and checks every rule with its own functions.

What is proven:

- ``plan``: every lift's path, place in the yard, order, hook and rope; with ``shape`` (cells cover triangles),
  ``stands`` (the building is stable at every stage) and ``site_rules`` (zones, wind, clearance of the rope)
- ``motion``: every motion; with ``durations`` (the crew's times), ``ends``, ``load`` (what the load hits), ``hook``
  (the empty hook and the jib) and ``swing``
- ``crane``: the crane itself (axes, capacity, luffing jib), and several cranes with each other
- ``over_time``: plan and motions while obstructions change; ``coverage``: no check passes without samples

How it is proven:

- ``bodies``: how deep triangle meshes overlap, and which cells they fill
- ``marks``, ``space``, ``placements``: raw cells, and where a load is between samples
- ``moment``, ``between``: what is where before each lift and during empty hook moves
- ``footprint``: which cells a proof checked, for revisions; ``lift``: shared base
"""
