"""Report and web page."""
