"""Exercises judged by what they do: `statemachine check`."""
