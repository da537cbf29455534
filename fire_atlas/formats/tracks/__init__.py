"""Files of flake tracks and of the light of a fire."""
