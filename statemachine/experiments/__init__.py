"""One experiment a file: `run(model, …)` returns a frozen result and prints nothing.

They stand on the public interface alone, so that each runs on every backend.
"""
