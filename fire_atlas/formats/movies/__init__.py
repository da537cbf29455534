"""Files that play an animation without an engine: animated images and videos."""
