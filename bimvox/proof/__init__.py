"""Everything that ``verify`` does: the proof of a plan, independent of the planner.

It imports only records, grid, site and crane, and checks every rule with its own functions.

What is proven:

- ``plan``: every lift's path, place in the yard, order, hook and rope; with ``shape`` (cells cover triangles),
  ``stands`` (the building is stable at every stage) and ``site_rules`` (zones, wind, clearance of the rope)
- ``motion``: every motion; with ``axes`` (clock, rates, ranges), ``durations`` (the crew's times), ``ends``,
  ``capacity``, ``load`` (what the load hits), ``hook`` (the empty hook and the jib; ``jib`` for luffing ones) and
  ``swing``
- ``cranes`` and ``turns``: several cranes keep their distance and wait for each other
- ``over_time``: plan and motions while obstructions change; ``coverage``: no check passes without samples

How it is proven:

- ``bodies``: how deep triangle meshes overlap, and which cells they fill
- ``marks``, ``space``, ``placements``: raw cells, and where a load is between samples
- ``pendulum``, ``braking``, ``crane_way``, ``crane_distance``: how a load swings, an axis stops, cranes pass
- ``moment``, ``between``: what is where before each lift and during empty hook moves
- ``footprint``: which cells a proof checked, for revisions; ``kept``: results kept per object; ``lift``: shared base
"""
