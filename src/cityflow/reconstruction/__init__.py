"""One building: points and outline to a closed hull. Methods stand side by side."""
