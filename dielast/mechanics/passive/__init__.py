"""Films with an active part within a passive part, on a rigid ring or between bars."""
