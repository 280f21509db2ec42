"""Time integration, roots, quadrature and random streams: mathematics without any mechanics."""
