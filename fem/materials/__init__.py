"""Materials: parameters, library, laws, failure."""
