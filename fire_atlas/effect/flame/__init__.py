"""Flame analysis: feature vectors, segmentation, and measurements of the whole clip."""
