"""Whole builds: recipes and clips in, files out."""
