"""The catalog of a survey, and that of a run's products, as static STAC."""
