# What maturin puts here: the functions and constants of include/skep.h, through cffi.
from typing import Any

ffi: Any
lib: Any
