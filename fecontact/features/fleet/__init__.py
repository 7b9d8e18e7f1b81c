"""Feature: share of the contacts of many measured wheels and rails where Hertz holds; no other folder imports it."""
