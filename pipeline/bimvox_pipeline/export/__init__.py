"""``bimvox export``."""
