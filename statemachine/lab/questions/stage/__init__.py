"""Two runs on a stage with a slider: the scene of both, lanes, and charts that follow it."""
