"""What the keys of a recipe promise to be seen, and whether it is."""
