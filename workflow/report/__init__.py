"""What reports share: charts, scenes in 3D, tables, templates, and the scripts that draw them (`assets/`)."""
