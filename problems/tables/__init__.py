"""Tables as people keep them, in spreadsheets and data frames, to the fields of an instance."""
