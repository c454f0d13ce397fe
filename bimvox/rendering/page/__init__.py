"""A plan as one self-contained web page: it opens offline, and asks nobody for anything."""
