"""Looking at what was built, from the written files alone."""
