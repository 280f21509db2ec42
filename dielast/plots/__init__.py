"""Figures for print: each function takes a result and returns a matplotlib figure."""
