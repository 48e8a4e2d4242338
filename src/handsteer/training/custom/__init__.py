"""Custom signs: collects takes of hands, and trains a model that distinguishes them from all other hands."""
