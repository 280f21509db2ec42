"""`dielast mastercurve`."""
