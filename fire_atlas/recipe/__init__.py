"""Recipes: YAML read with its line numbers, merged, and validated by pydantic models."""
