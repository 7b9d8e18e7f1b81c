"""A feature: in how many of the contacts of many measured wheels and rails Hertz holds; no room imports it."""
