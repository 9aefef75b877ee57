"""A whole run from one TOML file: measured error, four designs, report."""
