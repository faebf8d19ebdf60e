"""One contact in three programs: scenarios as data, and drivers that run them and return the same arrays."""
