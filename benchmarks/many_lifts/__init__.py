"""The time to find the paths of hundreds of lifts: our policy, our search, and third-party planners."""
