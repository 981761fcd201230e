"""The take that is open."""
