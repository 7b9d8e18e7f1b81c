"""Maps of a theory's verdicts over lateral shift and load.

The package has the positions of a map under many loads, their load limits, and their pictures, tables and reports.
"""
