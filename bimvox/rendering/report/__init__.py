"""The lift plan record: the document of a plan for the site, as one printable page."""
