"""Long work: what runs in processes of its own, and who waits for it."""
