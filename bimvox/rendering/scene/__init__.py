"""What a picture shows, as values."""
