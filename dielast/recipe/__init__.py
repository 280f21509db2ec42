"""Recipes: typed models of the TOML files that say what to run; one model feeds reading, errors and the JSON Schema."""
