"""What results are called: measures, verdicts, cases and rolls."""
