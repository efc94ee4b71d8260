"""What people see of work while it goes on."""
