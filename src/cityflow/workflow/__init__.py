"""What a user asks for: workflow files read and checked; runs started, planned, explained, repeated."""
