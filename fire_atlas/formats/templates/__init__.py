"""Text files made by Jinja templates."""
