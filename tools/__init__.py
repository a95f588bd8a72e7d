"""What maintainers run: checks, reference figures, mutants, fuzzers, benchmarks."""
