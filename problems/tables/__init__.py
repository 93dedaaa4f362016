"""Import of instances from spreadsheets and data frames with arbitrary column names and units."""
