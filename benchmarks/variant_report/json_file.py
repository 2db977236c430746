"""Reading JSON, compressed or not, so that whatever is wrong with a file is one line that says where."""

import json

# Ratios of numbers between these are numbers too, and have logarithms.
SMALLEST, LARGEST = 1e-9, 1e15


class InputError(Exception):
    """One line: which file, where in it, what is wrong with it."""


def kind_of(value):
    for types, name in [(bool, "true or false"), (dict, "an object"), (list, "a list"), (str, "text"),
                        ((int, float), "a number")]:
        if isinstance(value, types):
            return name
    return "null"


class Part:
    """A value of a file, which knows where it stands there."""

    def __init__(self, file, place, value):
        self.file = file
        self.place = place
        self.value = value

    def fault(self, what):
        return InputError(": ".join(part for part in [self.file, self.place, what] if part))

    def expect(self, kind):
        if kind_of(self.value) != kind:
            raise self.fault(f"{kind} is expected, not {kind_of(self.value)}")
        return self.value

    def member(self, key):
        if key not in self.expect("an object"):
            raise self.fault(f"has no '{key}'")
        shown = key if key.isprintable() else repr(key)
        return Part(self.file, f"{self.place}.{shown}" if self.place else shown, self.value[key])

    def members(self, key):
        """The parts of the list of that name."""
        part = self.member(key)
        return [Part(self.file, f"{part.place}[{i}]", value) for i, value in enumerate(part.expect("a list"))]

    def items(self):
        return [(key, self.member(key)) for key in self.expect("an object")]

    def text(self, key):
        return self.member(key).expect("text")

    def name(self, key):
        """Text that fits a table's cell and a picture's title."""
        part = self.member(key)
        if not part.expect("text").isprintable() or not part.value:
            raise part.fault(f"{part.value!r} is no name: it is empty, or holds what cannot be printed")
        return part.value

    def number(self, key, positive=False):
        part = self.member(key)
        value = part.expect("a number")
        if value < 0 or (positive and value == 0):
            raise part.fault(f"is {value:g}, but must be {'above' if positive else 'at least'} 0")
        if not (SMALLEST if positive else 0) <= value <= LARGEST:
            raise part.fault(f"is out of range ({SMALLEST:g} to {LARGEST:g})")
        return value


def uncompressed(path, data):
    try:
        # Not above: a Python without liblzma still reads what is not compressed.
        import lzma
    except ImportError as error:
        raise InputError(f"{path}: this Python cannot uncompress it ({error}), xz --decompress can") from error
    try:
        return lzma.decompress(data)
    except lzma.LZMAError as error:
        raise InputError(f"{path}: cannot be uncompressed: {error}") from error


def content(path):
    try:
        with open(path, "rb") as file:
            data = file.read()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    return uncompressed(path, data) if path.endswith(".xz") else data


def no_number(text):
    raise ValueError(f"{text} is no number")


def parse(path):
    """The file's value."""
    try:
        return Part(path, "", json.loads(content(path).decode("utf-8"), parse_constant=no_number))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not JSON: byte {error.start} is not UTF-8") from error
    except ValueError as error:
        raise InputError(f"{path}: not JSON: {error}") from error
    except RecursionError as error:
        raise InputError(f"{path}: not JSON: nested too deeply") from error


def load(path, tag, what):
    """The file's value, which must be an object whose "format" is the tag."""
    file = parse(path)
    data = file.value
    if not isinstance(data, dict) or data.get("format") != tag:
        found = repr(data.get("format"))[:40] if isinstance(data, dict) else kind_of(data)
        raise file.fault(f"not a file of {what}: its 'format' should be '{tag}', found: {found}")
    return file
