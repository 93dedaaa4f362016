"""The policies that are built in."""
