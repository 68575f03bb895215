"""Making catalogs from files, and checking them before a run."""
