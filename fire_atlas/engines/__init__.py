"""A folder for each engine: the files it plays as they are."""
