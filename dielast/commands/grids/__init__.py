"""`dielast failure-map` and `dielast design`."""
