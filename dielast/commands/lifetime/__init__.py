"""`dielast lifetime`."""
