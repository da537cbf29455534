"""Fire-flakes that fly with a clip (Kim & Lee 2019)."""
