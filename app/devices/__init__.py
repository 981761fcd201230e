"""What is connected: gloves, trackers, and the filter that serves them."""
