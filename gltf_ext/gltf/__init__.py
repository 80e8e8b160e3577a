"""Reading and writing glTF files. Knows nothing about compression."""
