"""What hard cases try: the trials of each family, and the small bodies, meshes and surfaces that they share."""
