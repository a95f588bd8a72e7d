"""What `compare` and `trace` are asked: Requests and answers, pages, films, figures."""
