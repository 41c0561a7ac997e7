"""Who does the pieces of a study: this machine, a Dask cluster that is there, or one that a job array makes."""
