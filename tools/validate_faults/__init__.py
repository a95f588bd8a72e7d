"""Wrong parameters, and which cases of `statemachine validate` notice them."""
