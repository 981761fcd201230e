"""A report: one page that opens anywhere, offline, with everything that was measured of a take."""
