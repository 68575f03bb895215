"""Steps of a roof where photographs show their edges."""
