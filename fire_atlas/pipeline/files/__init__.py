"""From pages to files, and which files a recipe writes."""
