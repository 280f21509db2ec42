"""The names of the laws that failures are fitted to."""

BREAKDOWN_LAWS, DAMAGE_LAWS = ("table", "power"), ("inverse-power", "eyring")
LAWS = (*BREAKDOWN_LAWS, *DAMAGE_LAWS)
LINES = {"exponential": "exponential", "inverse-power": "power"}
"""Laws of the time over the voltage, and the law of ageing by the voltage that each is."""
