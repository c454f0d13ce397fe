"""SHA-256 of what the program writes, recorded, and checked while its inside is changed."""
