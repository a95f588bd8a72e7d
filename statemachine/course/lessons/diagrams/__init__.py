"""The three diagrams of the course, each drawn from a Model: what it has, and nothing by heart."""
