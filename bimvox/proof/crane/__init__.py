"""What the crane itself must keep, whatever it carries.

- ``axes``: clock, rates, ranges and rests of its axes; ``capacity``: the load chart; ``jib``: what a luffing jib meets
- ``separation``: several cranes keep their distance (``way``: the pose of one at any time; ``distance`` between two);
  ``turns``: they wait for each other
- ``pendulum``: how a load swings on its rope; ``braking``: how an axis stops
"""
