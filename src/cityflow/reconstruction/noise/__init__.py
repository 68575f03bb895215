"""What of a cloud is noise."""
