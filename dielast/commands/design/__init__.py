"""`dielast design`."""
