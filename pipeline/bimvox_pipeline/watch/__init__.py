"""``bimvox watch``."""
