"""Everything that people look at: pictures (``draw``, ``scene``), films, plots, the page and the report."""
