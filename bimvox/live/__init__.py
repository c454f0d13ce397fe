"""A site that moves: people and lorries in simulated traffic, a shield that yields to them, and who decides."""
