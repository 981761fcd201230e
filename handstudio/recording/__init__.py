"""Takes on disk: writing, reading, recovering, importing, finding. Formats: README.md here."""
