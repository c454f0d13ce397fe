"""A plan as one self-contained web page that works offline and makes no network requests."""
