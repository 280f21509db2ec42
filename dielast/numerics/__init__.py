"""Time integration, roots and random streams: mathematics that knows no film."""
