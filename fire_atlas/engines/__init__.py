"""Exports to game engines, a package for each."""
