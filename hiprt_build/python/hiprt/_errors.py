"""The exceptions of hiprt. Their messages are the library's: what is wrong, where, expected and found."""


class Error(RuntimeError):
    """What the library reports. All exceptions of hiprt derive from it."""


class InputError(Error, ValueError):
    """An argument, a mesh or a file that the library refuses. Also: more than a BVH file can express."""


class OutOfMemoryError(Error, MemoryError):
    """There is not enough memory."""


class FileError(Error, OSError):
    """A file could not be opened, read, written or renamed."""


class Cancelled(Error):
    """A progress callback returned False. After Ctrl-C, KeyboardInterrupt is raised instead."""


class GpuError(Error):
    """No GPU, no driver, no run-time compiler, or an error that the driver reports."""
