"""What surrounds a computation: terminal, launched programs, environment, last words."""
