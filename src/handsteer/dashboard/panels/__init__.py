"""The panels of the pages: each builds its elements once and then only changes what has changed."""
