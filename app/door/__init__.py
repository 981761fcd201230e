"""Who may come in: host, origin, token."""
