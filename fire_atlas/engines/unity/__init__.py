"""Finished assets for Unity 2021.3 and later."""
