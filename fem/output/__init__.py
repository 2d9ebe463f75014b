"""Fields, histories, watch points, results and their comparison."""
