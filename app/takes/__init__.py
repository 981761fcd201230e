"""Takes as they are made and kept."""
