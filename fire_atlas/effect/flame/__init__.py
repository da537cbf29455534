"""Flame analysis: feature vectors, which pixels are flame, and what holds for the whole clip."""
