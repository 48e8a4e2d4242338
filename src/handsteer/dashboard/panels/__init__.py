"""The pages' panels: each builds its elements once, and then updates only what has changed."""
