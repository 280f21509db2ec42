"""Files that one command writes and the next command reads: material files, draws, master curves."""
