"""What stands in the way of an instance: why tasks stay unserved, and data that may not be what was meant."""
