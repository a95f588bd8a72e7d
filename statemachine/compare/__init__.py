"""Comparison: where two simulators, or two descriptions of a robot, part, and by how much."""
