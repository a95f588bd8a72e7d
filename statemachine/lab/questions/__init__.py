"""What `compare` and `trace` are asked: a Request and its answer each, its page, its film, its figure."""
