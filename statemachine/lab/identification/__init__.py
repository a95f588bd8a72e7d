"""Is it the arm or the simulator: a recording of a real arm against its model, and a fit of the model."""
