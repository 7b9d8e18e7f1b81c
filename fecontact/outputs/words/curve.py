"""What a map says of the places that a vehicle visits."""

ZONES = ("HOLDS", "UNRESOLVED", "FAILS", "failed", "not on the map")
