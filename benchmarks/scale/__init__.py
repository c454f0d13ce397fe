"""How the cost of a plan grows with the number of its components: ``make bench-scale``."""
