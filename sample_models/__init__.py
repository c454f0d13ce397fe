"""Sample models, written by code: small, ours, and byte-identical each time. Development only; not installed."""
