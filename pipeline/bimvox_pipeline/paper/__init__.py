"""``bimvox experiment paper``: the paper's experiments over many seeds, resumable, with a report."""
