"""Points: a case with settings; kept in a store, in which every stage's product is once."""
