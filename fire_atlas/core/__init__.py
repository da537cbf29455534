"""Basics that every other package builds on: pixels, clips, errors, random numbers, files."""
