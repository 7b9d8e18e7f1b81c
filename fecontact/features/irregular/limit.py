"""Default limit of the models.

The module imports no arrays, so that the help of the command can read the limit.
"""

LIMIT = 0.05
"""Default limit: the largest error of force and peak pressure with which a model holds."""
