import a_program_that_is_not_installed  # noqa: F401
