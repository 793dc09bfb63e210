"""Tests of the package; a package itself, as some wheels (dartpy) install one named tests."""
