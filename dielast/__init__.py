"""dielast."""
