"""Effects of the model: description, criterion, cost and source."""
