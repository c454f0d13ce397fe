"""The pages that follow from the code, one a command and one a format: ``make site`` writes them, git ignores them."""
