"""JSON descriptions of pages, frames and animations."""
