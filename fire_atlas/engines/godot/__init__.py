"""Export to Godot 3 and 4."""
