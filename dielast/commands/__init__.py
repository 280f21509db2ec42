"""From a checked recipe to a report: read the inputs, call the library, lay out tables, summary and figure."""
