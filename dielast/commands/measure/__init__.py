"""`dielast measure`."""
