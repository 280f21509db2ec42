"""Relaxation spectra from curves."""
