"""Simulations of specimens and films: relaxation, creep, actuation, failure maps and designs."""
