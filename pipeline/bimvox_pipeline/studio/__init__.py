"""``bimvox studio``: the server behind its web page, on this machine only."""
