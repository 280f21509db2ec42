"""Calibration of a material with a laboratory's tests: parameters, simulated tests, the fit, and its uncertainty."""
