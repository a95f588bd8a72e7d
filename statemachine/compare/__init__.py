"""Where two runs part, by how much, and why."""
