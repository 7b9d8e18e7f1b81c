"""Results as plain values for JSON and CSV files, and their restoration."""
