"""Text files rendered from Jinja templates."""
