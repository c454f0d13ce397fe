"""From a path to the timed motion of a crane."""
