"""Cranes: machines, geometry, kinematics, reach, load chart, wind and the point-to-point time bound."""
