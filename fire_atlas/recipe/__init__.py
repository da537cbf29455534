"""Recipes: read YAML with its line numbers, merge it, and validate it with pydantic models."""
