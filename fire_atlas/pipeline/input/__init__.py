"""From the recipe to opened sources."""
