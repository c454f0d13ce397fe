"""Several cranes on one site, in space and time."""
