"""A compiled learner for deep Q-learning, for observations that are mostly zero; it needs no torch."""
