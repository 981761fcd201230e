"""What a subject can do: motions by name, and the small language that puts them together."""
