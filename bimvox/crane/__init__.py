"""Cranes: geometry, kinematics, reach, load chart and the point-to-point time bound."""
