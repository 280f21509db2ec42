"""Films of which an active part moves within a passive part: on a rigid ring, or between bars."""
