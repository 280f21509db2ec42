"""The result of a run: its files, its summary, its comparison with golden files, and pages of results."""
