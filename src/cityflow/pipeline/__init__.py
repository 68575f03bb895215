"""The stages in the order of the flow, and what becomes ready when."""
