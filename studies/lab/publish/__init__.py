"""What results/published holds: made, copied, and checked by rows that are drawn at random and run again."""
