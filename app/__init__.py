"""The studio in the browser, on viser: way of working, hand, plots, transport."""
