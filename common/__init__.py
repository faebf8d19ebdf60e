"""What all parts of the package share: messages to users, units, files that are whole or not there. It imports none of them."""
