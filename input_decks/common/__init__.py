"""What several cases share: parameter groups, derived numbers, packings and deck fragments."""
