"""``bimvox policy``."""
