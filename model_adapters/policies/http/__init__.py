"""Policies behind a server: a client of the `/act` convention that OpenVLA's deployment script began."""
