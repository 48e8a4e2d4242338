"""What every answer of the page's server tells browsers: nothing in frames, nothing from elsewhere, nothing told on."""

from typing import Final

# NiceGUI's pages have scripts and styles within, and Vue compiles their templates.
_CONTENT: Final = {
    "default-src": "'none'",
    "script-src": "'self' 'unsafe-inline' 'unsafe-eval'",
    "style-src": "'self' 'unsafe-inline'",
    "img-src": "'self' data: blob:",
    "font-src": "'self' data:",
    "connect-src": "'self'",
    "worker-src": "'self'",
    "media-src": "'self' blob:",
    "form-action": "'none'",
    "base-uri": "'none'",
    "frame-ancestors": "'none'",
}

HEADERS: Final = (
    ("Content-Security-Policy", "; ".join(f"{name} {sources}" for name, sources in _CONTENT.items())),
    ("X-Frame-Options", "DENY"),
    ("X-Content-Type-Options", "nosniff"),
    # The address has the token until the browser has its cookie.
    ("Referrer-Policy", "no-referrer"),
    ("Cross-Origin-Opener-Policy", "same-origin"),
    ("Cross-Origin-Resource-Policy", "same-origin"),
    ("Permissions-Policy", "camera=(self)"),
)
"""Name and value of each; they go with pages, static files, video and errors alike."""
