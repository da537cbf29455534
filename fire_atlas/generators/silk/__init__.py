"""Simulate fire as sheets of cloth with animated textures: source ``silk`` (Balci & Foroosh)."""
