"""Files that one stage leaves for another: how each is written, and read again."""
