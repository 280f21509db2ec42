"""Relaxation spectra from master curves of relaxation, oscillation and creep."""
