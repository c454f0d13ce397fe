"""The stages over files: the only part that knows both the library and the disk."""
