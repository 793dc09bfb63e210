"""What did it learn? The learned torque, taken apart into physics."""
