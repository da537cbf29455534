"""Output folders: builds write all their files or none, and recognise them later."""
