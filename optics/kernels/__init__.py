"""The ground floor: the array backend, compiled kernels, the cache of results, and tables read from files."""
