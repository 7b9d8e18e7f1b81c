"""Pages of HTML, and the files of a study."""
