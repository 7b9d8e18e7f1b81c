"""How inputs are described: their ranges, their texts, and where each of them stands."""
