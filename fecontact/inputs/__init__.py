"""Inputs with their units and ranges, declared at the fields of dataclasses.

The package has the texts of inputs (`texts`), their kinds (`kinds`), and the classes that read and check them
(`slots`).
"""
