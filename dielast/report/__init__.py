"""A run's result as files, as a summary, and beside golden files."""
