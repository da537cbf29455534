"""What a build is asked for: YAML read with its line numbers, merged, and held to the models."""
