"""Tiny models that the rooms of engines load, in the formats that engines read."""
