"""A material: its springs, spectrum, time-temperature shift, dielectric and breakdown constants."""
