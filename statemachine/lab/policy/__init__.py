"""Walking policies: the contract that one was trained with, its run on each engine, its faults."""
