"""The files that a user writes about a site: read, checked, written."""
