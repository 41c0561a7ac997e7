"""The reference against closed forms, published numbers and another code."""
