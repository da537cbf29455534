"""What a frame holds besides its colours: motion vectors, and its layers on their own."""
