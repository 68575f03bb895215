"""What notebooks and programs of others use: the algorithms on arrays, and the results of a RUN. `import cityflow` offers all names of it.

A function here gets values of `core` and gives such values; it makes from points or images what a stage reads from files, and calls the
same algorithm with the parameters of a run. `cityflow/__init__.py` names them and loads a file of this package when one of its names is used.
"""
