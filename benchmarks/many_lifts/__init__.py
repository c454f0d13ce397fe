"""How long it takes to find the ways of hundreds of lifts: our policy, our search, and other people's planners."""
