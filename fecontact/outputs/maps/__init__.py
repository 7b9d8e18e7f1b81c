"""Maps as values, their table, picture and files."""
