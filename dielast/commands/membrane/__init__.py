"""`dielast relax` and `dielast creep`."""
