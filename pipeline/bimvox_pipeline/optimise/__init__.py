"""The search for a better set-up of a site."""
