"""Output folders: write all files of a build or none, and find out when they are stale."""
