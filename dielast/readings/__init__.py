"""Measurements as they come from a laboratory's files."""
