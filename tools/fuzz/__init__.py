"""Fuzzers: odd input for the parts that meet strangers, bounded and seeded: `make fuzz`."""
