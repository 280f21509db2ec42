"""Simulations of tests on one material point."""
