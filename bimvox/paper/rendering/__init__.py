"""Pictures of the paper's construction site."""
