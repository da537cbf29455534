"""When: which frames follow each other, before anything is analysed."""
