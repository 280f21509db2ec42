"""One point of a film: kinematics, load, equilibrium, stability and events."""
