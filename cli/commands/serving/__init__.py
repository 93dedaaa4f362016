"""Commands that run as a service until they are stopped."""
