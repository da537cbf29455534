"""The line from recipe to files: a step a file."""
