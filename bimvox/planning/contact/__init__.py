"""Contact: which parts touch, and how deep a pair may overlap during insertion."""
