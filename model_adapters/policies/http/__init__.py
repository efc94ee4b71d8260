"""Policies behind a server: a client of the `/act` convention of OpenVLA's deployment script."""
