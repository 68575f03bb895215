"""Where each patch stands on the pages of a texture atlas."""
