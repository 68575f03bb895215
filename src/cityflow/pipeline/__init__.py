"""The stages in the order of the flow, and their dependencies."""
