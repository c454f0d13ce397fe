"""Logs: MCAP schemas, recorder and reader."""
