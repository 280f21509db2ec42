"""Sharing of work among processes and machines; no result depends on it."""
