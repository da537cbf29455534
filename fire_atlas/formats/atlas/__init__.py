"""JSON files that describe pages, frames and animations."""
