"""Commands about the installation and about results as a whole."""
