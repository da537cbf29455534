"""Pictures, pages and tables for people, made from the files of a build alone."""
