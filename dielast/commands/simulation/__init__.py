"""Parts that the simulating commands share."""
