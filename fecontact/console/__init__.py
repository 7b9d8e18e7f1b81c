"""Progress, messages and options that commands and features share."""
