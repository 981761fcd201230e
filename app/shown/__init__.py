"""Parts of the state: values that the page is drawn from, and what becomes of them. Pure."""
