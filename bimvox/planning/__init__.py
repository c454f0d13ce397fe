"""Planning: contact, order, yard, search, rollout, and the independent verifier."""
