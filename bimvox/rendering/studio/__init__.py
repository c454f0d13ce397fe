"""The web page on which people set up a site by hand."""
