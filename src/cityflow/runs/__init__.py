"""What a RUN is: its workflow with settings and overrides, its folder, and which of its records count now."""
