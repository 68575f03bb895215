"""What of a RUN goes into the report and the view, and the pictures in them."""
