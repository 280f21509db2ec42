"""`dielast spectrum`."""
