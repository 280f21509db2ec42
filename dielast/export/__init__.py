"""Material cards for finite-element codes: one module a code, each stating the code's own conventions."""
