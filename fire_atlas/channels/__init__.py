"""Maps beside the pages of an atlas: motion vectors, and the flame and flake layers alone."""
