"""Material cards for finite-element codes: one module for each code, which states the conventions of the code."""
