"""A material from a laboratory's own tests: what is free, how tests are followed, the fit, and what the tests tell."""
