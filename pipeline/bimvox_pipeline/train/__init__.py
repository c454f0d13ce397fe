"""``bimvox train``."""
