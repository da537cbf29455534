"""The pipeline from recipe to output files, a module for each step."""
