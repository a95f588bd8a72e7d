"""Is it the arm or the simulator? A recording of a real arm against its model, and a fit of it."""
