"""Files, written whole or not at all, and read with one error for every way of being damaged.

Whatever the package writes goes through `write_file`, and whatever it reads through the readers
here. A file appears under its name only when it is whole and on the disk; until then it is a
neighbour that ends in `.partial` and bears the number of the process that writes it.

The readers are around calls of libraries only, so that what they turn into a `FileProblem` is never
a fault of this package. What the contents mean is checked by `as_type`, or by who asked for them.

Comes in: paths, and what is to be written.
Goes out: files, and what they hold: text, documents, arrays; or a `FileProblem`.
"""

from .arrays import StoredArrays, arrays_sha256, read_arrays, write_arrays
from .documents import (
    as_type,
    from_text,
    read_json,
    read_sealed,
    read_toml,
    read_yaml,
    sealed,
    sha256,
)
from .reading import (
    LARGEST_FILE,
    REINSTALL,
    check_file,
    damaged,
    read_bytes,
    read_csv,
    read_text,
    reading,
)
from .writing import clear_partial_files, partial_path, temporary_folder, write_file
from .xml_files import LARGEST_DOCUMENT, parse_xml, read_xml, refuse_nan

__all__ = [
    "LARGEST_DOCUMENT",
    "LARGEST_FILE",
    "REINSTALL",
    "StoredArrays",
    "arrays_sha256",
    "as_type",
    "check_file",
    "clear_partial_files",
    "damaged",
    "from_text",
    "parse_xml",
    "partial_path",
    "read_arrays",
    "read_bytes",
    "read_csv",
    "read_json",
    "read_sealed",
    "read_text",
    "read_toml",
    "read_xml",
    "read_yaml",
    "reading",
    "refuse_nan",
    "sealed",
    "sha256",
    "temporary_folder",
    "write_arrays",
    "write_file",
]
