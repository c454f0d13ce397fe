"""The MCAP container: records, messages and recovery."""
