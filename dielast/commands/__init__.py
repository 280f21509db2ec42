"""The subcommands: each reads the inputs of a checked recipe, calls the library, and makes tables, summary and figures."""
