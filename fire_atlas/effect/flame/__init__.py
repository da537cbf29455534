"""Flame analysis: features, motion and what in the picture is flame."""
