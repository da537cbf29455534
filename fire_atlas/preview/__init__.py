"""Preview of finished builds for people, read from the written files alone."""
