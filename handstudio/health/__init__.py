"""How a stream does: figures, what is wrong with it, and what of that is kept in a take."""
