"""Files that Godot plays as they are: sprite frames, a scene, import settings and flakes."""
