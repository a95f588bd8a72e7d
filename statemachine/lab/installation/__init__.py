"""What is installed here: engines, their releases, and what to do about what is missing."""
