"""From layers to a picture: motion blur, composition, and the light of a frame."""
