"""Planning of lifts: erection sequence, yard, contact, insertion, search and policy roll-out."""
