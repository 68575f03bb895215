"""The RUN: its workflow with settings and overrides, its folder, and its current records."""
