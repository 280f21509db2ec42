"""What every other part rests on: errors, units, registries."""
