"""Contact: which parts touch, and how deep a pair may overlap on the way in."""
