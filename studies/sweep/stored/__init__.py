"""What is stored of studies, looked up by the index of their folders."""
