"""Benchmarks: ratios in one process, interleaved, with a null; never timed tests."""
