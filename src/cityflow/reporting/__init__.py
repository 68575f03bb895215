"""Contents of the report and the view of a RUN, and their pictures."""
