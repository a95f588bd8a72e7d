"""From a file to a compiled model, and what is read of one; nothing outside asks MuJoCo itself."""
