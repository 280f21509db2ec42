"""Time-temperature superposition: from measurements at several temperatures to a master curve."""
