"""``bimvox experiment paper``: the paper's experiments over many seeds, resumable, and what they come to."""
