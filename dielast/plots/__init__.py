"""Figures that a paper could print: each function takes a result and returns a matplotlib figure."""
