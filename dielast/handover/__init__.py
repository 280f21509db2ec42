"""What one command writes and the next one reads."""
