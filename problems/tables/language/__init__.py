"""How people write what tables hold: names of columns, units and numbers."""
