"""A result folder: tables, figures, the record of studies, an HTML page, the comparison of two folders.

Imports: `model`, `plot` and the rooms below. Begin with `files`.
"""
