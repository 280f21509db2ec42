"""`dielast actuate`."""
