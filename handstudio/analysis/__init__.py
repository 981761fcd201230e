"""Motion to numbers."""
