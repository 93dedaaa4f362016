"""Recognition of column names, units and numbers as users write them."""
