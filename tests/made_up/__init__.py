"""The room of the made-up engine "hidden": two parts, and of all others none."""
