"""Results folders: what an experiment gave, stored so that it is read again or refused by name.

Comes in: an `Experiment`, and the strides and the summary of its cells.
Goes out: `Results` on disk, with where they are from.
"""

from .folder import check_completion, default_folder, make_folder, remove_if_empty
from .lock import locked
from .provenance import describe_run
from .results import Results
from .strides_file import encode

__all__ = [
    "Results",
    "check_completion",
    "default_folder",
    "describe_run",
    "encode",
    "locked",
    "make_folder",
    "remove_if_empty",
]
