"""Maps beside the pages: how the flame moves from frame to frame, and its layers on their own."""
