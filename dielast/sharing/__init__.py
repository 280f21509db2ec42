"""Work shared among processes and machines; results do not depend on it."""
