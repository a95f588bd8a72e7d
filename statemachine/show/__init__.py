"""Pages as Markdown from templates; knows blocks, and no question that a page answers."""
