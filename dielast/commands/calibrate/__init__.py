"""`dielast calibrate`."""
