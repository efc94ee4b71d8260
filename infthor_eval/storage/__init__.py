"""Files and folders of this machine: written whole or not at all, found, limited, hashed."""
