def outcomes():
    return []
