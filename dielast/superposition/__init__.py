"""From measurements at several temperatures to a master curve."""
