"""Files and pictures in three dimensions."""
