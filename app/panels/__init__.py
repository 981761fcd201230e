"""Panels translate: a person's doings into intents, a view into what the page shows."""
