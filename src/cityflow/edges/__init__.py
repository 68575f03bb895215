"""Where photographs show a straight edge of a roof: for units that are to be parted, for models, and for what is said of both."""
