"""What several tests use, by concept; no test imports another test."""
