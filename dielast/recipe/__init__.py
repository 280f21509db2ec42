"""Recipes: typed models of the TOML files that say what to run, used for reading, error messages and the JSON Schema."""
