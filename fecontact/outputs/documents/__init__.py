"""What is told of results, part by part, for a terminal and for a page alike."""
