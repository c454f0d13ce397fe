"""The lift plan record: what a site keeps of a plan, as one page that prints."""
