"""Events as text: CSV, and v2e's .txt."""
