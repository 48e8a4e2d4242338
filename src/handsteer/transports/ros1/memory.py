"""Lets the C library keep the memory of images for the next ones."""

import ctypes
import functools

# Names and numbers of malloc.h; GNU's library takes no larger threshold than this.
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3
_LARGEST_KEPT_BYTES = 2**25


@functools.cache
def keep_freed_memory() -> None:
    """Let what is freed, up to 32 MB at once, be given out again; does nothing where there is no ``mallopt``.

    rospy makes a buffer of 16 MB for each read of an image. By itself the library gives each back to the system and
    gets the next one from there, page by page, which takes as long as all else that receiving an image does.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError):
        return
    mallopt(_M_MMAP_THRESHOLD, _LARGEST_KEPT_BYTES)
    mallopt(_M_TRIM_THRESHOLD, 2 * _LARGEST_KEPT_BYTES)
