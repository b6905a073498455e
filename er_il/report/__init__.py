"""Tables, figures, films and pages, rendered from results."""
