"""Commands of the shell, by subject; `handstudio.cli` gathers them."""
