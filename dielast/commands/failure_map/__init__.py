"""`dielast failure-map`."""
