"""From a case to its solved and judged loads."""
