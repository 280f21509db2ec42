"""Kinematics, load, equilibrium, stability and failure criteria of films."""
