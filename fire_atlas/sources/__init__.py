"""Where the fire comes from: each kind of source becomes a Clip."""
