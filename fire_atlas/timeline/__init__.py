"""Decide which frames follow each other, before anything in them is analysed."""
