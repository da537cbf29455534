"""Measures of images that know nothing of fire."""
