"""The guide: a page in Markdown for each topic, shown by `fecontact guide TOPIC` and linked from the README."""
