"""A case: its parameters, profiles and variants, its declared quantities, and the decks written from it."""
