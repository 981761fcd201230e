"""Motion to files of the field."""
