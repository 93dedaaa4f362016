"""File formats of instances and allocations, and their readers and writers."""
