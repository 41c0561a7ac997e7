"""One time step: prediction, prescribed motion, integration."""
