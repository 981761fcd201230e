"""Measurements with a command each: figures beside the references, as a table and as JSON."""
