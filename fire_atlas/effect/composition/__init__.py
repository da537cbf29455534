"""Turn the flame and flake layers into a picture: motion blur, blending, and a frame's light."""
