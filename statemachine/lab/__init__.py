"""What can be found out about a model and its engines: runs, comparisons, causes, surveys."""
