"""Results as plain values: what JSON and CSV files hold, and what is read back from them."""
