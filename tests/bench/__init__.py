"""Benchmarks: scripts to run by hand, each prints a table and fails past its bounds."""
