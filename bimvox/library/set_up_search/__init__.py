"""The search for a better set-up of a site: proposals, estimates, and what no other beats."""
