"""What the tests of several packages make, run and check with."""
