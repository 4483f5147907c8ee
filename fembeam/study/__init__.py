"""Studies: questions asked of a scene or a model by many runs, each answered by a table and a figure."""
