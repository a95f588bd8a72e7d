"""Each engine against independent code and closed forms."""
