"""Results and pages made visible: text for a terminal, JSON for a program, progress."""
