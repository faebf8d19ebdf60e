"""What all parts of the package share: messages to users, units, files that are complete or absent. It imports none of them."""
