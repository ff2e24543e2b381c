"""The files of an evaluation: tables, figures, pictures, and files for other tools."""
