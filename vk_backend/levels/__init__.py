"""Levels of detail: tables, pages and the memory that they take."""
