"""Fit an effect into a budget: which of its frames are kept on the pages, and how high."""
