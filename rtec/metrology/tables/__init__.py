"""Tables as instruments and people write them: where the columns are, what their headings mean, what is in a cell."""
