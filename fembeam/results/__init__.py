"""A result folder: tables, figures, the record of studies, an HTML page, the comparison of two folders.

Imports: `model`, `plot` and what they import. Begin with `files`.
"""
